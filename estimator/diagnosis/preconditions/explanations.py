"""What would explain a recording that does not fit its model, with odds: units, signs, columns, periods."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from scipy.special import ndtr

from estimator.diagnosis.preconditions.inertia import Inertia
from estimator.errors import Cure
from estimator.physics.model import DrivelineModel, Motion
from estimator.signals.record import OutputKind, Record

# --- what may be wrong


class Part(Enum):
    """What a factor belongs to."""

    TORQUE, OUTPUT, MODEL = range(3)


RPM, DEGREE, TURN = math.pi / 30.0, math.pi / 180.0, 2.0 * math.pi

TURNS_AND_LINES = (Motion.ROTATION, Motion.TRANSLATION)


@dataclass(frozen=True, slots=True)
class Row:
    """One mistake that is a factor."""

    question: str  # what to ask
    part: Part
    low: float  # what the column is to be multiplied by is between them, evenly in its logarithm
    high: float
    prior: float
    kinds: tuple[OutputKind, ...] = (OutputKind.SPEED, OutputKind.POSITION, OutputKind.ACCELERATION)
    motions: tuple[Motion, ...] = (Motion.ROTATION,)  # the outputs and motions it can be made with
    reads: tuple[float, float] | None = None
    whole: bool = False  # whether the torques then are whole numbers


_SPEED, _POSITION = (OutputKind.SPEED,), (OutputKind.POSITION,)
_LINE = (Motion.TRANSLATION,)

GEARS = (3.0, 16.0)  # ratios of the gears behind traction motors

RIGHT = Row("", Part.MODEL, 1.0, 1.0, 1.0, motions=TURNS_AND_LINES)
"""Nothing is wrong with the recording: the model lacks physics."""

_T, _O, _M = Part.TORQUE, Part.OUTPUT, Part.MODEL
_ANY = Row("", _T, 1.0, 1.0, 1.0).kinds
_KP_N = 9.80665
_ANOTHER = "is the inertia in the model file that of another vehicle or in another unit, about {0} times it"
_CENT = "is the torque in per cent of a rated torque of about {2} Nm"
_MILLE = "is the torque in per mille of a rated torque of about {3} Nm"
_WHOLE = "is the torque in whole per mille of a rated torque of about {3} Nm, as drives send it"

ROWS: tuple[Row, ...] = (
    Row("is the speed in rpm, expected rad/s", _O, RPM, RPM, 0.2, _SPEED),
    Row("is the output in degrees, expected radians", _O, DEGREE, DEGREE, 0.04),
    Row("is the speed in turns per second, expected rad/s", _O, TURN, TURN, 0.03, _SPEED),
    Row("was a speed in rad/s scaled as if it were in rpm", _O, 1.0 / RPM, 1.0 / RPM, 0.03, _SPEED),
    Row("was an output in radians scaled as if it were in degrees", _O, 1.0 / DEGREE, 1.0 / DEGREE, 0.01),
    Row("is the speed the vehicle's in km/h, expected the motor's in rad/s", _O, 1.4, 15.0, 0.04, _SPEED),
    Row("is the position in turns, expected radians", _O, TURN, TURN, 0.05, _POSITION),
    Row("is the speed in km/h, expected m/s", _O, 1.0 / 3.6, 1.0 / 3.6, 0.2, _SPEED, _LINE),
    Row("was a speed in m/s scaled as if it were in km/h", _O, 3.6, 3.6, 0.03, _SPEED, _LINE),
    Row("is the output in thousandths (mm), expected m", _O, 1e-3, 1e-3, 0.1, _ANY, _LINE),
    Row("is the output in hundredths (cm), expected m", _O, 1e-2, 1e-2, 0.03, _ANY, _LINE),
    Row("is the output in thousandths, expected radians", _O, 1e-3, 1e-3, 0.01),
    Row("is the torque in kNm (a force in kN), expected Nm (N)", _T, 1e3, 1e3, 0.06, _ANY, TURNS_AND_LINES),
    Row("is the torque in mNm (a force in mN), expected Nm (N)", _T, 1e-3, 1e-3, 0.04, _ANY, TURNS_AND_LINES),
    Row("is the torque in Ncm, expected Nm", _T, 1e-2, 1e-2, 0.01),
    Row("was a force in N scaled as if it were in kp", _T, 1.0 / _KP_N, 1.0 / _KP_N, 0.01, _ANY, _LINE),
    Row("is the force in kp, expected N", _T, _KP_N, _KP_N, 0.01, _ANY, _LINE),
    Row(_CENT, _T, 0.2, 30.0, 0.2, _ANY, TURNS_AND_LINES, (10.0, 200.0)),
    Row(_WHOLE, _T, 0.02, 5.0, 3.0, _ANY, TURNS_AND_LINES, (20.0, 3000.0), whole=True),
    Row(_MILLE, _T, 0.02, 5.0, 0.06, _ANY, TURNS_AND_LINES, (20.0, 3000.0)),
    Row("is the torque a share of a rated torque of about {0} Nm", _T, 20.0, 3000.0, 0.05, reads=(0.1, 2.0)),
    Row("is the torque that of one of three phases, expected that of all", _T, 3.0, 3.0, 0.01),
    Row("is the torque a current in A, by a torque constant of about {0} Nm/A", _T, 0.05, 5.0, 0.04),
    Row("is the inertia in the model file in kg cm^2, expected kg m^2", _M, 1e-4, 1e-4, 0.04),
    Row("is the inertia in the model file in g m^2, expected kg m^2", _M, 1e-3, 1e-3, 0.02),
    Row(_ANOTHER, _M, 1.0 / 30.0, 30.0, 0.1, _ANY, TURNS_AND_LINES),
)


def _gear_rows(gear_ratio: float | None) -> Iterator[Row]:
    """Yield what a gear between motor and wheel makes wrong; sharp where the model has its ratio."""
    low, high = GEARS if gear_ratio is None else (gear_ratio, gear_ratio)
    for part, what in ((Part.TORQUE, "torque"), (Part.OUTPUT, "speed")):
        question = "is the {0} that at the wheel, expected at the motor shaft: a gear ratio of about {1}"
        twice = "was the {0} reflected though it was at the motor shaft: a gear ratio of about {1}"
        up = part is Part.OUTPUT
        factor = (low, high) if up else (1.0 / high, 1.0 / low)
        inverse = (1.0 / high, 1.0 / low) if up else (low, high)
        yield Row(question.format(what, "{0}" if up else "{1}"), part, *factor, 0.15)
        yield Row(twice.format(what, "{1}" if up else "{0}"), part, *inverse, 0.01)
    at_wheel = "is the inertia in the model file that at the wheel, expected at the motor shaft"
    yield Row(at_wheel, Part.MODEL, high**-2, low**-2, 0.02)
    yield Row(
        "was the gear ratio used the wrong way round for the torque or the speed", Part.MODEL, low**2, high**2, 0.03
    )


def rows_for(line: DrivelineModel) -> list[Row]:
    """Return the mistakes that can be made with a model's recordings."""
    gears = _gear_rows(line.gear_ratio) if line.motion is Motion.ROTATION else ()
    return [*(row for row in ROWS if line.motion in row.motions), *gears]


@dataclass(frozen=True, slots=True)
class Change:
    """What may be wrong with columns beyond a factor, undone; ``prior`` as in `Row`."""

    record: Record
    prior: float = 1.0
    question: str = ""
    cure: Cure = field(default_factory=lambda: Cure(""))
    factors: int = 1
    physics: bool = False


SLOWEST_S, FASTEST_S = 0.5, 1e-5
"""A driveline sampled slower, or faster, is more likely recorded in another unit of time."""

SHORTEST_S = 1.0  # no recording of a driveline is shorter

PERIODS = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 4e-3, 5e-3, 1e-2, 2e-2, 5e-2, 1e-1)
"""Usual periods [s], for times that are counted in rows."""

UNLIKELY = 0.02  # prior of a period that no driveline is sampled with, and of each that rows may have


DAY_S = 86_400.0

TIME_UNITS = {1e-3: "ms", 1e-6: "us", DAY_S: "days"}
"""Units of time that a column may have, by their size [s]."""


def changes_of(record: Record) -> Iterator[Change]:
    """Yield a recording as it was read, then with what may be wrong undone."""
    in_range = FASTEST_S <= record.sample_time_s <= SLOWEST_S
    yield Change(record, 1.0 if in_range else UNLIKELY, factors=2)
    yield from column_changes(record)
    factors = {1e-3: 0.1, 1e-6: 0.05, DAY_S: 0.05, 60.0: 0.005, 0.1: 0.01, 10.0: 0.01, 0.5: 0.002, 2.0: 0.002}
    if record.sample_time_s == 1.0:
        factors |= dict.fromkeys(PERIODS, UNLIKELY)
    for factor, prior in factors.items():
        period_s = factor * record.sample_time_s
        if FASTEST_S <= period_s <= SLOWEST_S and record.okay.size * period_s >= SHORTEST_S:
            unit = f"Is time in {TIME_UNITS[factor]}, expected s" if factor in TIME_UNITS else None
            text = f"is the sampling period {period_s:.3g} s, as read {record.sample_time_s:.3g} s? "
            timed = replace(record, sample_time_s=period_s, time_s=factor * record.time_s)
            yield Change(
                timed, prior, text + (unit or "Is time in another unit"), Cure(record.name, time=factor), factors=0
            )


def column_changes(record: Record) -> Iterator[Change]:
    """Yield what may be wrong with the columns whatever the model is: a sign, two swapped, a position for a speed."""
    count = record.torque_nm.shape[1]
    for i in range(count if count > 1 else 0):
        turned = record.torque_nm * np.where(np.arange(count) == i, -1.0, 1.0)
        yield Change(
            replace(record, torque_nm=turned),
            0.2,
            f"is the sign of torque input {i + 1} turned round (all count positive in the direction of the speed)",
            Cure(record.name, torque=-1.0, inputs=(i,)),
            factors=0,
        )
    for i in range(count):
        torque, good = record.torque_nm.copy(), np.flatnonzero(record.okay)
        torque[:, i] = np.interp(np.arange(record.okay.size), good, record.output[good])
        yield Change(
            replace(record, torque_nm=torque, output=record.torque_nm[:, i], torque_okay=None),
            0.05,
            f"are the columns of torque input {i + 1} and of the output swapped",
            Cure(record.name, swapped=i),
            factors=0,
        )
    good = np.flatnonzero(record.okay)
    output = np.interp(np.arange(record.okay.size), good, record.output[good])
    if record.kind is OutputKind.SPEED:
        yield Change(
            replace(record, output=np.gradient(output, record.sample_time_s)),
            0.05,
            "is the speed a position",
            Cure(record.name, kind=OutputKind.POSITION.value),
        )
    elif record.kind is OutputKind.POSITION:
        yield Change(
            replace(record, output=np.cumsum(output) * record.sample_time_s),
            0.05,
            "is the position a speed",
            Cure(record.name, kind=OutputKind.SPEED.value),
        )


# --- how well an explanation fits

CLOSE = 0.6, 0.1
"""Spread of the logarithm of the inertia's ratio: this share of the tolerance, and the error of its fit."""

PHYSICS, PHYSICS_SHARE = math.log(2.0), 0.08
"""Spread where physics is missing or a payload is on, and how often that is."""

BANDS, BANDS_PHYSICS, BANDS_OTHER = 0.35, 0.1, 1.2
"""Spread of the two bands' ratio by one factor, the share of the cases that spread as another model's do, and that."""

REST = 4.0  # power of the unexplained motion in the likelihood: as of eight independent stretches
LEAST_REST = 0.02  # share of the motion that the shortest model error leaves unexplained

USUAL_TORQUE_NM, USUAL_SPEED_RAD_S = (200.0, math.log(8.0)), (80.0, math.log(5.0))
"""Median, and spread of the logarithm, of the largest torque and speed in a recording of a drive."""

WHOLE, FEWEST_VALUES = 1e-6, 5
"""How far whole numbers may be off, and how many there must be: fewer are levels that were asked for."""


def _normal(x: float, spread: float) -> float:
    return math.exp(-0.5 * (x / spread) ** 2) / (spread * math.sqrt(2.0 * math.pi))


def _between(x: float, low: float, high: float, spread: float) -> float:
    """Return the density of a logarithm that is even between two, and spreads."""
    if high <= low:
        return _normal(x - low, spread)
    return float(ndtr((x - low) / spread) - ndtr((x - high) / spread)) / (high - low)


def _fit_of(row: Row, needed: float, spread: float) -> float:
    """Return the density of the factor that is needed, by its logarithm."""
    low, high = math.log(row.low), math.log(row.high)
    close, far = (_between(needed, low, high, each) for each in (spread, math.hypot(spread, PHYSICS)))
    return (1.0 - PHYSICS_SHARE) * close + PHYSICS_SHARE * far


def _bands_of(log_ratio: float, is_model: bool) -> float:
    if math.isnan(log_ratio):
        return 1.0
    other = _normal(log_ratio, BANDS_OTHER)
    return other if is_model else (1.0 - BANDS_PHYSICS) * _normal(log_ratio, BANDS) + BANDS_PHYSICS * other


def largest(record: Record) -> tuple[float, float]:
    torque, output = np.abs(record.torque_nm).max(axis=1), np.abs(record.output[record.okay])
    return float(np.quantile(torque, 0.999)), float(np.quantile(output, 0.999))


def are_whole_numbers(record: Record) -> bool:
    """Tell whether the torques of a recording are whole numbers, more than a few levels that were asked for."""
    read = record.torque_nm[np.isfinite(record.torque_nm).all(axis=1)]
    return bool(np.abs(read - np.round(read)).max() <= WHOLE) and np.unique(read).size >= FEWEST_VALUES


@dataclass(frozen=True, slots=True)
class Explanation:
    """A change and up to two factors, with its weight, and the largest torque and output that follow."""

    change: Change
    rows: tuple[tuple[Row, float], ...]
    weight: float
    torque_nm: float
    output: float
    is_turned: bool = False

    @property
    def is_physics(self) -> bool:
        """Whether nothing is wrong with the recording: what is there is for a diagnosis to find."""
        return self.change.physics or not (self.rows or self.change.question or self.is_turned)

    @property
    def is_a_factor(self) -> bool:
        """Whether it is a factor alone, as a payload can be, too; whole per mille are no payload."""
        return not self.change.question and not self.is_turned and not any(row.whole for row, _ in self.rows)

    @property
    def cure(self) -> Cure | None:
        """What to correct in the recording; None where that is not known, or the model is to be corrected.

        Two factors are never corrected at once: many pairs have the product of another one. Nor are a column and a
        factor out of a range: what lacks physics fits so, too.
        """
        is_fitted = bool(self.change.question) and any(row.low != row.high for row, _ in self.rows)
        is_certain = len(self.rows) < 2 and not is_fitted
        if any(row.part is Part.MODEL for row, _ in self.rows) or self.is_physics or not is_certain:
            return None
        cure = replace(self.change.cure, recording=self.change.record.name)
        for row, factor in self.rows:
            rounded = factor if row.low == row.high else float(f"{factor:.2g}")
            cure = (
                replace(cure, torque=cure.torque * rounded)
                if row.part is Part.TORQUE
                else replace(cure, output=cure.output * rounded)
            )
        return replace(cure, output=-cure.output) if self.is_turned else cure

    def question(self, falls: str) -> str:
        asked = [self.change.question] if self.change.question else []
        asked += [falls] if self.is_turned else []
        asked += [
            row.question.format(*map(_rough, (factor, 1.0 / factor, 100.0 * factor, 1e3 * factor)))
            for row, factor in self.rows
        ]
        return ", and ".join(asked) or "does the model lack physics, or a load that was on"


def explanations(change: Change, found: Inertia, rows: Sequence[Row], spread: float) -> Iterator[Explanation]:
    """Yield all that explains the inertia that a recording fits, each with its weight."""
    record, needed = change.record, -math.log(abs(found.ratio))
    torque, output = largest(record)
    is_turned = found.ratio < 0.0
    rest = max(1.0 - found.share, LEAST_REST)
    common = change.prior * rest**-REST * (0.15 if is_turned else 1.0)
    is_whole = are_whole_numbers(record)

    def explained(*chosen: Row) -> Explanation:
        exact = sum(_sign(row) * math.log(row.low) for row in chosen if row.low == row.high)
        ranged = next((row for row in chosen if row.low != row.high), None)
        over = needed - exact
        if ranged is None:
            fit = _fit_of(RIGHT, over, spread)
        else:
            fit = _fit_of(ranged, _sign(ranged) * over, spread)
        factors = [
            (row, row.low if row.low == row.high else float(np.clip(math.exp(_sign(row) * over), row.low, row.high)))
            for row in chosen
        ]
        by_torque = math.prod(factor for row, factor in factors if row.part is Part.TORQUE)
        by_output = math.prod(factor for row, factor in factors if row.part is Part.OUTPUT)
        weight = common * fit * math.prod(row.prior for row in chosen)
        weight *= _bands_of(found.log_ratio, any(row.part is Part.MODEL for row in chosen))
        weight *= usual(chosen, torque, torque * by_torque, output * by_output, record)
        return Explanation(change, tuple(factors), weight, torque * by_torque, output * by_output, is_turned)

    yield explained()
    possible = [row for row in rows if record.kind in row.kinds and (is_whole or not row.whole)]
    for k, row in enumerate(possible if change.factors else ()):
        yield explained(row)
        for other in possible[k + 1 :] if change.factors > 1 else ():
            if {row.part, other.part} == {Part.TORQUE, Part.OUTPUT} and (
                row.low == row.high or other.low == other.high
            ):
                yield explained(row, other)


def _rough(value: float) -> str:
    """Return a number that is as exact as the model is."""
    return f"{float(f'{value:.2g}'):g}"


def _sign(row: Row) -> float:
    """Return the power with which a factor enters the inertia that is fitted: that goes with the torque."""
    return 1.0 if row.part is Part.TORQUE else -1.0


def usual(chosen: Sequence[Row], read: float, torque_nm: float, output: float, record: Record) -> float:
    reads = next((row.reads for row in chosen if row.reads is not None), None)
    if reads is not None:
        density = float(reads[0] <= read <= reads[1]) / math.log(reads[1] / reads[0])
    else:
        median, spread = USUAL_TORQUE_NM
        density = _normal(math.log(max(torque_nm, 1e-12) / median), spread)
    median, spread = USUAL_SPEED_RAD_S
    return density * _normal(math.log(max(output, 1e-12) / median) if record.kind is OutputKind.SPEED else 0.0, spread)
