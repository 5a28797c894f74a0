"""What would explain recordings that do not fit their model: the one table of units, signs, columns, periods, models.

A row is a factor. A change is anything else: how recording or model is transformed, the words, the line that cures it.
Physics that is easily taken for a wrong unit is among them, and so is "something else" (``plausible``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial

import numpy as np

from estimator.diagnosis.preconditions.channels import dead_rows
from estimator.diagnosis.preconditions.inertia import Measured, bridged
from estimator.diagnosis.priors import MistakePriors
from estimator.diagnosis.thresholds import Mistakes
from estimator.errors import Cure
from estimator.physics.model import DrivelineModel, Motion, Parameter, Structure
from estimator.signals.record import FloatArray, OutputKind, Record

# --- factors

RPM, DEGREE, TURN = math.pi / 30.0, math.pi / 180.0, 2.0 * math.pi

_SPEED, _POSITION = (OutputKind.SPEED,), (OutputKind.POSITION,)
_MOVES = (OutputKind.SPEED, OutputKind.POSITION, OutputKind.ACCELERATION)
_ANY, _LINE, _BOTH = tuple(OutputKind), (Motion.TRANSLATION,), (Motion.ROTATION, Motion.TRANSLATION)

_KP_N = 9.80665
_CENT = "per cent of a rated torque of about {2} Nm"
_MILLE = "per mille of a rated torque of about {3} Nm"

DAY_S = 86_400.0
TIME_UNITS = {1e-3: "ms", 1e-6: "us", DAY_S: "days"}
"""Units of time that a column may have, by their size [s]."""

MASSES = (Structure.TWO_MASS, Structure.THREE_MASS)


class Part(Enum):
    """What a factor belongs to."""

    TORQUE, OUTPUT, MODEL = range(3)


@dataclass(frozen=True, slots=True)
class Row:
    """One mistake that is a factor."""

    question: str  # what to ask
    part: Part  # what is to be multiplied
    low: float  # what the column is to be multiplied by is between them, evenly in its logarithm
    high: float  # upper end
    prior: float  # probability before a recording is seen
    kinds: tuple[OutputKind, ...] = tuple(OutputKind)  # outputs it can be made with
    motions: tuple[Motion, ...] = (Motion.ROTATION,)  # the outputs and motions it can be made with
    reads: tuple[float, float] | None = None  # between which its largest value stands in the file
    whole: bool = False  # whether the torques then are whole numbers
    alone: bool = False  # whether it can only be so in one of several recordings

    @property
    def sign(self) -> float:
        """The power with which the factor enters the inertia that is fitted: that goes with the torque."""
        return 1.0 if self.part is Part.TORQUE else -1.0


_T, _O, _M = Part.TORQUE, Part.OUTPUT, Part.MODEL

ROWS: tuple[Row, ...] = (
    Row("is the speed in rpm, expected rad/s", _O, RPM, RPM, 0.2, _SPEED),
    Row("is the output in degrees, expected radians", _O, DEGREE, DEGREE, 0.04, _MOVES),
    Row("is the speed in turns per second, expected rad/s", _O, TURN, TURN, 0.03, _SPEED),
    Row("was a speed in rad/s scaled as if it were in rpm", _O, 1.0 / RPM, 1.0 / RPM, 0.03, _SPEED),
    Row("was an output in radians scaled as if it were in degrees", _O, 1.0 / DEGREE, 1.0 / DEGREE, 0.01, _MOVES),
    Row("is the speed the vehicle's in km/h, expected the motor's in rad/s", _O, 1.4, 15.0, 0.04, _SPEED),
    Row("is the position in turns, expected radians", _O, TURN, TURN, 0.05, _POSITION),
    Row("is the speed in km/h, expected m/s", _O, 1.0 / 3.6, 1.0 / 3.6, 0.2, _SPEED, _LINE),
    Row("was a speed in m/s scaled as if it were in km/h", _O, 3.6, 3.6, 0.03, _SPEED, _LINE),
    Row("is the output in thousandths (mm), expected m", _O, 1e-3, 1e-3, 0.1, _MOVES, _LINE),
    Row("is the output in hundredths (cm), expected m", _O, 1e-2, 1e-2, 0.03, _MOVES, _LINE),
    Row("is the output in thousandths, expected radians", _O, 1e-3, 1e-3, 0.01, _MOVES),
    Row("is the torque in kNm (a force in kN), expected Nm (N)", _T, 1e3, 1e3, 0.06, _ANY, _BOTH),
    Row("is the torque in mNm (a force in mN), expected Nm (N)", _T, 1e-3, 1e-3, 0.04, _ANY, _BOTH),
    Row("is the torque in Ncm, expected Nm", _T, 1e-2, 1e-2, 0.01),
    Row("was a force in N scaled as if it were in kp", _T, 1.0 / _KP_N, 1.0 / _KP_N, 0.01, _ANY, _LINE),
    Row("is the force in kp, expected N", _T, _KP_N, _KP_N, 0.01, _ANY, _LINE),
    Row(f"is the torque in {_CENT}", _T, 0.2, 30.0, 0.2, _MOVES, _BOTH, (10.0, 200.0)),
    Row(
        f"is the torque in whole {_MILLE}, as drives send it",
        _T, 0.02, 5.0, 3.0, _MOVES, _BOTH, (20.0, 3000.0), whole=True,
    ),
    Row(f"is the torque in {_MILLE}", _T, 0.02, 5.0, 0.06, _MOVES, _BOTH, (20.0, 3000.0)),
    Row("is the torque a share of a rated torque of about {0} Nm", _T, 20.0, 3000.0, 0.05, reads=(0.1, 2.0)),
    Row("is the torque that of one of three phases, expected that of all", _T, 3.0, 3.0, 0.01),
    Row("is the torque that of one of two equal inverters, expected the sum", _T, 2.0, 2.0, 0.02),
    Row("does the torque count twice: the sum is named, and half of it again", _T, 0.5, 0.5, 0.02),
    Row("is the torque a current in A, by a torque constant of about {0} Nm/A", _T, 0.05, 5.0, 0.04),
    Row(
        "is it of another vehicle, or with another payload, than the others: its inertia fits {0} times the nominal",
        _M, 1.0 / 3.0, 3.0, 1.0, _MOVES, _BOTH, alone=True,
    ),
    Row(
        "is the inertia in the model file that of another vehicle, with another payload, or in another unit, about {0} "
        "times it", _M, 1e-3, 1e3, 0.2, _MOVES, _BOTH,
    ),
)  # fmt: skip


def _gear_rows(gear_ratio: float | None) -> Iterator[Row]:
    """Yield what a gear between motor and wheel makes wrong; sharp where the model has its ratio."""
    low, high = MistakePriors.GEARS if gear_ratio is None else (gear_ratio, gear_ratio)
    for part, what in ((Part.TORQUE, "torque"), (Part.OUTPUT, "speed")):
        question = "is the {0} that at the wheel, expected at the motor shaft: a gear ratio of about {1}"
        twice = "was the {0} reflected though it was at the motor shaft: a gear ratio of about {1}"
        up = part is Part.OUTPUT
        factor = (low, high) if up else (1.0 / high, 1.0 / low)
        inverse = (1.0 / high, 1.0 / low) if up else (low, high)
        yield Row(question.format(what, "{0}" if up else "{1}"), part, *factor, 0.15, _MOVES)
        yield Row(twice.format(what, "{1}" if up else "{0}"), part, *inverse, 0.01, _MOVES)
    at_wheel = "is the inertia in the model file that at the wheel, expected at the motor shaft"
    yield Row(at_wheel, Part.MODEL, high**-2, low**-2, 0.02, _MOVES)
    inverse_used = "was the gear ratio used the wrong way round for the torque or the speed"
    yield Row(inverse_used, Part.MODEL, low**2, high**2, 0.03, _MOVES)


def rows_for(line: DrivelineModel | None, kind: OutputKind, is_whole: bool) -> list[Row]:
    """Return the factors that can be wrong in recordings of a line; without a line, those that a size alone tells."""
    if line is None:
        return [row for row in ROWS if row.question.startswith("is the speed in rpm") and kind in row.kinds]
    rows = [*(row for row in ROWS if line.motion in row.motions)]
    rows += _gear_rows(line.gear_ratio) if line.motion is Motion.ROTATION else ()
    return [row for row in rows if kind in row.kinds and (is_whole or not row.whole)]


# --- all that is no factor

Line = DrivelineModel | None


@dataclass(frozen=True, slots=True)
class Change:
    """What may be wrong beyond a factor, undone: in the recordings, or in the model."""

    question: str = ""  # what to ask
    prior: float = 1.0  # probability before a recording is seen
    of_record: Callable[[Record], Record] | None = None  # undoes it in a recording
    of_line: Callable[[DrivelineModel], DrivelineModel] | None = None  # undoes it in the model
    cure: Cure | None = None  # without one, there is no line that undoes it
    factors: int = 0  # how many factors may be wrong, too
    is_physics: bool = False  # nothing is wrong then: what is there is for a diagnosis to find
    may_be_alone: bool = True  # whether one of several recordings may have it alone
    is_of_one: bool = False  # whether it can only be so in one of several
    is_open: bool = False  # it may be physics as well, so that it is doubted and not refused

    def undone_in(self, record: Record) -> Record:
        """Return a recording with it undone."""
        return record if self.of_record is None else self.of_record(record)


def changes_of(seen: Measured, line: Line) -> Iterator[Change]:
    """Yield nothing, then all that may be wrong beyond a factor in what was measured."""
    records, period_s = seen.records, seen.records[0].sample_time_s
    yield Change(
        prior=1.0 if Mistakes.FASTEST_S <= period_s <= Mistakes.SLOWEST_S else MistakePriors.UNLIKELY, factors=2
    )
    if records[0].imposed is None:
        yield from _of_inputs(records[0], line)
        if line is not None:
            yield from of_one_unit(records[seen.off], seen.ratio)
        yield from _of_columns(records[0])
    yield from _of_time(records)
    if line is not None:
        yield from _of_shifts(records[0].kind.value, seen.lags_s)
        yield from _of_model(line, abs(seen.ratio))
        yield from _of_physics(records, line)


def _of_inputs(record: Record, line: Line) -> Iterator[Change]:
    """Yield what may be wrong with one of several inputs."""
    count, name = record.torque_nm.shape[1], record.name
    for i in range(count if count > 1 else 0):
        turned = _scaled(np.where(np.arange(count) == i, -1.0, 1.0))
        question = f"is the sign of {record.input(i)} turned round (all count positive in the direction of the speed)"
        yield Change(question, 0.2, turned, cure=Cure(name, torque=-1.0, inputs=(i,)))
        if line is not None:
            kept = _scaled(np.where(np.arange(count) == i, 0.0, 1.0))
            question = f"does {record.input(i)} count twice, in the others, too"
            yield Change(question, 0.05, kept, cure=Cure(name, dropped=i))
        if line is not None and np.ptp(record.torque_nm[:, i]) == 0.0:
            question = f"is {record.input(i)} dead, while its inverter drives as the others do"
            yield Change(question, 0.3, partial(_as_others, i=i))


def _of_columns(record: Record) -> Iterator[Change]:
    """Yield that a column has another's role, or none, or is dead for a while."""
    count, name = record.torque_nm.shape[1], record.name
    for i in range(count):
        question = f"are the columns of {record.input(i)} and of the output swapped"
        yield Change(question, 0.05, partial(_swapped, i=i), cure=Cure(name, swapped=i))
    for unused in record.unused:
        added = f"{unused.label} looks like a torque and is not used: is it another inverter's"
        yield Change(
            added, 0.3, partial(_with, label=unused.label, is_added=True), cure=Cure(name, columns=(unused.label,))
        )
        instead = f"{unused.label} looks like a torque and is not used: is it the one that drives"
        cure = Cure(name, columns=(unused.label,), is_instead=True)
        yield Change(instead, 0.1, partial(_with, label=unused.label, is_added=False), cure=cure)
    if len(record.unused) > 1:
        labels = tuple(unused.label for unused in record.unused)
        question = f"{' and '.join(labels)} look like torques and are not used: do they drive"
        of_all = lambda each: replace(each, torque_nm=np.column_stack([u.output for u in each.unused]))  # noqa: E731
        yield Change(question, 0.1, of_all, cure=Cure(name, columns=labels, is_instead=True))
    if record.kind is OutputKind.SPEED:
        cure = Cure(name, kind=OutputKind.POSITION.value)
        yield Change("is the speed a position", 0.05, _differentiated, cure=cure, factors=1)
    elif record.kind is OutputKind.POSITION:
        cure = Cure(name, kind=OutputKind.SPEED.value)
        yield Change("is the position a speed", 0.05, _summed, cure=cure, factors=1)
    dead = np.logical_or.reduce([dead_rows(record.torque_nm[:, i], record.sample_time_s) for i in range(count)])
    if dead.any():
        ends = f"from {record.time_s[dead][0]:.4g} to {record.time_s[dead][-1]:.4g} s"
        question = f"is a torque dead {ends}, where its reading stands still"
        yield Change(question, 0.1, _without_dead, is_open=True)  # a vehicle that rolls has no torque either


def of_one_unit(record: Record, ratio: float) -> Iterator[Change]:
    """Yield that one of several inputs is in a unit of its own, by the factor that makes the inertia the nominal."""
    total, count = record.total_torque_nm, record.torque_nm.shape[1]
    for i in range(count if count > 1 and ratio != 1.0 else 0):
        share = float(record.torque_nm[:, i] @ total) / (float(total @ total) or 1.0)
        factor = float(f"{(1.0 / ratio - 1.0 + share) / (share or 1.0):.2g}")
        is_thousand = factor > 0.0 and abs(abs(math.log10(factor)) - Mistakes.DECADES) < Mistakes.DECADES_OFF
        if not (Mistakes.OF_ONE[0] < factor < Mistakes.OF_ONE[1] or is_thousand):
            continue
        at = np.where(np.arange(count) == i, factor, 1.0)
        question = (
            f"is {record.input(i)} in a unit of its own, to be multiplied by about {factor:g}, or is its inverter's "
            "gain that far off"
        )
        cure = Cure(record.name, torque=factor, inputs=(i,))
        yield Change(
            question,
            0.05 / Mistakes.STEPS,
            _scaled(at),
            cure=cure,
            is_open=1.0 / Mistakes.MOST_GAIN < factor < Mistakes.MOST_GAIN,
        )


def _of_time(records: Sequence[Record]) -> Iterator[Change]:
    """Yield that times are in another unit, or that one recording has another period than the others."""
    record, period_s = records[0], records[0].sample_time_s
    usual_s = float(np.median([each.sample_time_s for each in records]))
    if any(not math.isclose(each.sample_time_s, usual_s, rel_tol=Mistakes.SAME_PERIOD) for each in records):
        question = f"is the sampling period {usual_s:.3g} s as the others'? Is its time in another unit"
        yield Change(question, 0.1, partial(_at_period, period_s=usual_s), is_of_one=True)
    factors = {1e-3: 0.1, 1e-6: 0.02, DAY_S: 0.05, 60.0: 0.005, 0.1: 0.01, 10.0: 0.01, 0.5: 0.002, 2.0: 0.002}
    if period_s == 1.0:
        factors |= dict.fromkeys(MistakePriors.PERIODS, MistakePriors.UNLIKELY)
    for factor, prior in factors.items():
        if (
            Mistakes.FASTEST_S <= factor * period_s <= Mistakes.SLOWEST_S
            and record.okay.size * factor * period_s >= Mistakes.SHORTEST_S
        ):
            unit = f"Is time in {TIME_UNITS[factor]}, expected s" if factor in TIME_UNITS else "Is time in another unit"
            question = f"is the sampling period {factor * period_s:.3g} s, as read {period_s:.3g} s? {unit}"
            timed, cure = partial(_timed, by=factor), Cure(record.name, time=factor)
            yield Change(question, prior, timed, cure=cure, may_be_alone=factor in TIME_UNITS)


def _of_shifts(output: str, lags_s: Sequence[float]) -> Iterator[Change]:
    """Yield that the output lags behind, or leads, the torque, by what the recordings show."""
    for lag_s in (lag for lag in lags_s if abs(lag) >= Mistakes.LEAST_SHIFT_S):
        side = "late" if lag_s > 0.0 else "early"
        question = (
            f"is the {output} {abs(lag_s):.3g} s {side} against the torque: a shift between columns, or "
            "a delay of that length"
        )
        yield Change(question, 0.1, partial(_shifted, lag_s=lag_s), is_open=True)


def _of_model(line: DrivelineModel, ratio: float) -> Iterator[Change]:
    if line.structure is Structure.TWO_MASS:
        swapped = lambda each: _with_inertias(each, J_M=each.parameters["J_L"], J_L=each.parameters["J_M"])  # noqa: E731
        yield Change("are J_M and J_L exchanged in the model file", 0.1, of_line=swapped)
        question = f"is J_L in the model file that of another vehicle or in another unit, about {ratio:.2g} times it"
        yield Change(question, 0.1 / Mistakes.STEPS, of_line=partial(_with_times, names=["J_L"], factor=ratio))
    inertias = [each for each in line.parameters if each.startswith("J")] if line.motion is Motion.ROTATION else []
    for names in [inertias, *([each] for each in inertias)] if len(inertias) > 1 else [inertias] if inertias else ():
        which = "the inertia" if names == inertias else names[0]
        for factor, unit, prior in MistakePriors.INERTIA_UNITS:
            question = f"is {which} in the model file {unit}"
            yield Change(question, prior, of_line=partial(_with_times, names=names, factor=factor), factors=1)


def _of_physics(records: Sequence[Record], line: DrivelineModel) -> Iterator[Change]:
    """Yield what a torque path with limits or with a loss over time lets through, and a clutch that slips."""
    if records[0].imposed is not None:
        return
    most = np.max([np.abs(record.torque_nm).max(axis=0) for record in records], axis=0)
    question = "does the torque stop at a limit, or is it lost over time"
    for share in Mistakes.LIMITS:
        for inputs in [range(most.size), *([i] for i in range(most.size if most.size > 1 else 0))]:
            limit = np.where(np.isin(np.arange(most.size), list(inputs)), share * most, np.inf)
            clipped = lambda each, at=limit: replace(each, torque_nm=np.clip(each.torque_nm, -at, at))  # noqa: E731
            yield Change(question, 0.005, clipped, is_physics=True)
    for depth in Mistakes.DEPTHS:
        for time in Mistakes.TIMES:
            yield Change(question, 0.005, partial(_fading, depth=depth, time=time), is_physics=True)
    if line.structure in MASSES:
        alone = partial(_with_times, names=["J_L"], factor=1e-3)
        yield Change("does a clutch slip, or is the shaft broken, so that the motor turns alone", 0.1, of_line=alone,
                     is_physics=True)  # fmt: skip


# --- transforms


def _scaled(by: FloatArray) -> Callable[[Record], Record]:
    return lambda record: replace(record, torque_nm=record.torque_nm * by)


def _swapped(record: Record, i: int) -> Record:
    torque = record.torque_nm.copy()
    torque[:, i] = bridged(record)
    return replace(record, torque_nm=torque, output=record.torque_nm[:, i], torque_okay=None)


def _as_others(record: Record, i: int) -> Record:
    torque = record.torque_nm.copy()
    torque[:, i] = np.delete(torque, i, axis=1).mean(axis=1)
    return replace(record, torque_nm=torque)


def _with(record: Record, label: str, is_added: bool) -> Record:
    column = next((each.output for each in record.unused if each.label == label), np.zeros(record.okay.size))
    read = record.torque_nm if is_added else np.empty((record.okay.size, 0))
    return replace(record, torque_nm=np.column_stack([read, column]), torque_okay=None)


def _timed(record: Record, by: float) -> Record:
    return replace(record, sample_time_s=by * record.sample_time_s, time_s=by * record.time_s)


def _at_period(record: Record, period_s: float) -> Record:
    return _timed(record, period_s / record.sample_time_s)


def _differentiated(record: Record) -> Record:
    return replace(record, output=np.gradient(bridged(record), record.sample_time_s))


def _summed(record: Record) -> Record:
    return replace(record, output=np.cumsum(bridged(record)) * record.sample_time_s)


def _without_dead(record: Record) -> Record:
    dead = np.logical_or.reduce([dead_rows(torque, record.sample_time_s) for torque in record.torque_nm.T])
    return replace(record, okay=record.okay & ~dead)


def _shifted(record: Record, lag_s: float) -> Record:
    rows = round(lag_s / record.sample_time_s)
    output, okay = np.roll(bridged(record), -rows), np.roll(record.okay, -rows)
    okay[-rows if rows > 0 else 0 : None if rows > 0 else -rows] = False
    return replace(record, output=output, okay=okay)


def _fading(record: Record, depth: float, time: float) -> Record:
    since = record.since_start_s[:, np.newaxis]
    return replace(record, torque_nm=record.torque_nm * (1.0 - depth * (1.0 - np.exp(-since / (time * since[-1])))))


def _with_inertias(line: DrivelineModel, **inertias: Parameter) -> DrivelineModel:
    return replace(line, parameters={**line.parameters, **inertias})


def _with_times(line: DrivelineModel, names: Sequence[str], factor: float) -> DrivelineModel:
    known = {name: line.parameters[name] for name in names}
    return _with_inertias(line, **{name: each.at(each.value * factor) for name, each in known.items()})
