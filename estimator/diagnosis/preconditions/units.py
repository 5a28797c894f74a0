"""Units: torque, output and time that are off by a factor or in sign."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.wording import times
from estimator.diagnosis.preconditions.inertia import Inertia, both_bands_agree, fitted_inertia
from estimator.errors import BadModel, Cure, Implausible
from estimator.physics.grid import Grid, grid_for
from estimator.physics.model import DrivelineModel, Motion, parameter_unit
from estimator.signals.record import FloatArray, OutputKind, Record

CLOSE = 1.35
"""Factor within which an inertia counts as close to a known factor: the nominal value itself may be off."""


@dataclass(frozen=True, slots=True)
class Factor:
    """A factor between units.

    Attributes
    ----------
    ratio : float
        Inertia that fits over the nominal one.
    name, question : str
        The factor, and what to ask.
    output, torque : float
        What the output, or the torque, is to be multiplied by.
    """

    ratio: float
    name: str
    question: str
    output: float = 1.0
    torque: float = 1.0

    @property
    def said(self) -> str:
        """The factor and the question, for people."""
        return f"{self.name}: {self.question}?"


def _too_large(factor: float, name: str, question: str, torque: bool = False) -> Factor:
    """Return a factor by which the output over the torque is read too large."""
    cure = {"torque": factor} if torque else {"output": 1.0 / factor}
    return Factor(1.0 / factor, f"1 / ({name})", question, **cure)


def _too_small(factor: float, name: str, question: str, torque: bool = False) -> Factor:
    """Return a factor by which it is read too small."""
    cure = {"torque": 1.0 / factor} if torque else {"output": factor}
    return Factor(factor, name, question, **cure)


KNOWN: tuple[Factor, ...] = (
    _too_large(60.0 / (2.0 * math.pi), "60/(2 pi)", "is the speed in rpm, expected rad/s"),
    _too_large(180.0 / math.pi, "180/pi", "is the output in degrees, expected radians"),
    _too_large(3.6, "3.6", "is the speed in km/h, expected m/s"),
    _too_large(
        1000.0,
        "1000",
        "is the torque in kNm (a force in kN) or the output in thousandths (mm), expected Nm (N) and m",
        torque=True,
    ),
    _too_large(100.0, "100", "is the output in hundredths (cm, %), or the torque a share of 100 Nm"),
    _too_small(60.0 / (2.0 * math.pi), "60/(2 pi)", "was a speed in rad/s scaled as if it were in rpm"),
    _too_small(180.0 / math.pi, "180/pi", "was an output in radians scaled as if it were in degrees"),
    _too_small(3.6, "3.6", "was a speed in m/s scaled as if it were in km/h"),
    _too_small(
        1000.0, "1000", "is the torque in mNm (a force in mN), or time in ms, expected Nm (N) and s", torque=True
    ),
    _too_small(2.0 * math.pi, "2 pi", "is the speed in turns per second, expected rad/s"),
    _too_small(9.80665, "9.81", "was a force in N scaled as if it were in kp", torque=True),
)

AT_THE_WHEEL = "is the speed, the torque or the inertia at the wheel, expected at the motor shaft"


def close_factors(ratio: float, gear_ratio: float | None = None) -> list[Factor]:
    """Return the factors that a ratio of inertias is close to, nearest first."""
    table = list(KNOWN)
    if gear_ratio is not None:
        for power, name in ((1, "the gear ratio"), (2, "the gear ratio squared")):
            table.append(Factor(gear_ratio**power, name, AT_THE_WHEEL))
            table.append(Factor(gear_ratio**-power, f"1 / {name}", AT_THE_WHEEL))
    distance = {row: abs(math.log(ratio / row.ratio)) for row in table}
    return sorted((row for row in table if distance[row] <= math.log(CLOSE)), key=distance.__getitem__)


BEYOND = 2.5
"""Factor beyond an inertia's tolerance that is implausible: payloads, derating and closed clutches are less, the
smallest factor between units (3.6) is more."""

SLOWEST_S = 0.5
"""A driveline sampled slower than this is more likely recorded in another unit of time."""

CLEARLY = 0.5
"""Share of the unexplained motion that a torque turned round may leave: a mere factor is the simpler answer."""

BETTER = 0.75
"""The same where the inertia is inside its tolerance with that torque turned round, and outside as it was read."""

SWAPPED_TELLS = 0.9
"""Share of the motion that must follow from the torque where two columns are swapped back."""

MARGIN = 1.15
"""Factor beyond an inertia's tolerance from which on torques in whole numbers are taken for per mille."""

FEWEST_VALUES = 5
"""Different whole numbers at least: fewer are levels that were asked for."""

WHOLE = 1e-6
"""How far a whole number may be off one."""

PER_MILLE, PER_CENT = 1e-3, 1e-2

MOST_PER_MILLE = 50.0
"""Ratio of inertias up to which torques in whole numbers are per mille rather than in another unit: of 20 Nm rated."""

MOST_PER_CENT = 300.0
"""Torque in per cent of a rated one that no drive exceeds."""

MOST_LOAD = 10.0
"""Factor by which a load machine's torque may exceed all torque of the motor: more would turn the motor over."""

NAMED = 2
"""Known factors that a message names."""

LIMITS = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.07, 0.05)
"""Limits of a torque that are tried, in its largest reading: what is read beyond is not there."""

DEPTHS, TIMES = (0.5, 0.8, 0.95), (0.05, 0.3, 1.0)
"""Losses of a torque over time that are tried, and their time constants in the recording's length."""

UNKNOWN = "No common unit is off by this; is one of several torques counted with the wrong sign?"


def require_plausible_units(records: Sequence[Record], model: DrivelineModel) -> None:
    """Refuse recordings whose torque, output or time is off by a factor or in sign."""
    line = replace(model, effects={})
    for record in records:
        _require_plausible_load(record)
    for record in map(_less_its_load, records):
        if record.kind is OutputKind.FORCE:
            continue
        found = _inertia(record, line)
        if found is not None and _is_within_tolerance(found, line):
            continue
        is_plausible = found is not None and _is_plausible(found, line)
        if not is_plausible:
            _refuse_milliseconds(record, line)
            _refuse_swapped_columns(record, line)
        _refuse_one_torque_turned(record, line, found, is_plausible)
        if found is not None and (is_plausible or 1.0 < found.ratio < MOST_PER_MILLE):
            _refuse_per_mille(record, line, found)
        if is_plausible:
            continue
        if found is not None and not _is_of_the_torque_path(record, line, found):
            raise _off_by_a_factor(record, line, found)


def _less_its_load(record: Record) -> Record:
    """Return a recording with a measured load torque taken off the first input: as a whole a line moves under both."""
    if record.load_nm is None:
        return record
    torque = record.torque_nm.copy()
    torque[:, 0] -= record.load_nm
    return replace(record, torque_nm=torque, load_nm=None)


def _refuse_milliseconds(record: Record, line: DrivelineModel) -> None:
    """Refuse a recording that is plausible but for its unit of time."""
    if record.sample_time_s < SLOWEST_S:
        return
    shorter = 1e-3 * record.sample_time_s
    other = _inertia(replace(record, sample_time_s=shorter, time_s=1e-3 * record.time_s), line)
    if other is not None and _is_plausible(other, line):
        raise Implausible(
            f"recording {record.name} is implausible: its sampling period is {record.sample_time_s:g} s, and with "
            f"{shorter:g} s it fits the nominal inertia. Is time in ms, expected s? Give time its scale in "
            "[signals].",
            Cure(record.name, time=1e-3),
        )


def _require_plausible_load(record: Record) -> None:
    if record.load_nm is None:
        return
    load, torque = (float(np.abs(each).max()) for each in (record.load_nm, record.total_torque_nm))
    if load > MOST_LOAD * torque:
        raise Implausible(
            f"recording {record.name} is implausible: its measured load torque reaches {load:.3g} Nm, its torque "
            f"{torque:.3g} Nm. Is load in another unit, or not reflected to the motor shaft? Divide its scale in "
            "[signals] by the gear's ratio."
        )


def _refuse_swapped_columns(record: Record, line: DrivelineModel) -> None:
    """Refuse a recording that is plausible with a torque and the output exchanged."""
    for i in range(record.torque_nm.shape[1]):
        torque = record.torque_nm.copy()
        good = np.flatnonzero(record.okay)
        torque[:, i] = np.interp(np.arange(record.okay.size), good, record.output[good])
        other = _inertia(replace(record, torque_nm=torque, output=record.torque_nm[:, i], torque_okay=None), line)
        if other is not None and _is_within_tolerance(other, line) and other.share >= SWAPPED_TELLS:
            raise Implausible(
                f"recording {record.name} is implausible: it fits the nominal inertia with torque input {i + 1} and "
                "the output exchanged. Are their columns swapped in [signals]?",
                Cure(record.name, swapped=i),
            )


def _refuse_one_torque_turned(record: Record, line: DrivelineModel, found: Inertia | None, is_plausible: bool) -> None:
    """Refuse a recording that is plausible but for the sign of one of its torques."""
    unexplained = 1.0 if found is None else 1.0 - found.share
    for i in range(record.torque_nm.shape[1] if record.torque_nm.shape[1] > 1 else 0):
        turned = record.torque_nm.copy()
        turned[:, i] *= -1.0
        other = _inertia(replace(record, torque_nm=turned), line)
        if other is None:
            continue
        rest = 1.0 - other.share
        fits = _is_plausible(other, line) and not is_plausible and rest < CLEARLY * unexplained
        if fits or (_is_within_tolerance(other, line) and rest < BETTER * unexplained):
            raise Implausible(
                f"recording {record.name} is implausible: it fits the nominal inertia only with the sign of torque "
                f"input {i + 1} turned round. All torques count positive in the direction of the speed: give that "
                "column a negative scale in [signals].",
                Cure(record.name, torque=-1.0, inputs=(i,)),
            )


def _refuse_per_mille(record: Record, line: DrivelineModel, found: Inertia) -> None:
    """Refuse torques in whole numbers that fit by a factor alone: per mille of a rated torque, as drives send it.

    A payload is felt below the first mode and not above; where both are seen, both must be off by the factor.
    """
    tolerance = _tolerance(line)
    if (1.0 - tolerance) / MARGIN <= found.ratio <= (1.0 + tolerance) * MARGIN:
        return
    if not are_whole_numbers(record):
        return
    if not both_bands_agree(record, line, grid_or_none(record, line), found.ratio):
        return
    if _is_of_the_torque_path(record, line, found):
        return
    scale = float(f"{1.0 / found.ratio:.2g}")
    raise Implausible(
        f"recording {record.name} is implausible: its torques are whole numbers, and fit an inertia "
        f"{times(found.ratio)} times the nominal {_nominal(line)}. Are they per mille of a rated torque of about "
        f"{scale / PER_MILLE:.0f} Nm? "
        "Then the scale is a thousandth of the rated torque. If they are in Nm, correct the inertia in the model file, "
        "or its tolerance.",
        Cure(record.name, torque=scale),
    )


def are_whole_numbers(record: Record) -> bool:
    """Tell whether the torques of a recording are whole numbers, more than a few levels that were asked for."""
    read = record.torque_nm[np.isfinite(record.torque_nm).all(axis=1)]
    return bool(np.abs(read - np.round(read)).max() <= WHOLE) and np.unique(read).size >= FEWEST_VALUES


def _is_of_the_torque_path(record: Record, line: DrivelineModel, found: Inertia) -> bool:
    """Tell whether a torque that stops at a limit, or is lost over time, explains more than a factor does.

    Either makes an inertia look too large, and is an entry of the catalogue: not to be refused but to be found.
    """
    if found.ratio < 0.0:
        return False
    others = (_inertia(replace(record, torque_nm=torque), line) for torque in _lessened(record))
    rest = CLEARLY * (1.0 - found.share)
    return any(each is not None and _is_plausible(each, line) and 1.0 - each.share < rest for each in others)


def _lessened(record: Record) -> Iterable[FloatArray]:
    """Yield the torques that a path with limits, or with a loss over time, would let through, shape (N, M)."""
    read, count = record.torque_nm, record.torque_nm.shape[1]
    most = np.abs(read).max(axis=0)
    for share in LIMITS:
        for inputs in [range(count), *([i] for i in range(count if count > 1 else 0))]:
            limit = np.where(np.isin(np.arange(count), list(inputs)), share * most, np.inf)
            yield np.clip(read, -limit, limit)
    since = record.since_start_s[:, np.newaxis]
    for depth in DEPTHS:
        for time in TIMES:
            yield read * (1.0 - depth * (1.0 - np.exp(-since / (time * since[-1]))))


def grid_or_none(record: Record, line: DrivelineModel) -> Grid | None:
    """Return how a line is simulated; None where its modes can't be with the recording."""
    try:
        return grid_for(line, [record])
    except BadModel:
        return None


def _inertia(record: Record, line: DrivelineModel) -> Inertia | None:
    """Return the inertia that a recording fits; only as one body where the line's modes can't be simulated with it."""
    return fitted_inertia(record, line, grid_or_none(record, line))


def _tolerance(line: DrivelineModel) -> float:
    return max(parameter.tolerance for name, parameter in line.parameters.items() if name.startswith("J"))


def _is_within_tolerance(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning."""
    return 1.0 - _tolerance(line) <= found.ratio <= 1.0 + _tolerance(line)


def _is_plausible(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning, or of physics missing."""
    tolerance = _tolerance(line)
    return (1.0 - tolerance) / BEYOND <= found.ratio <= (1.0 + tolerance) * BEYOND


def _nominal(line: DrivelineModel) -> str:
    names = [name for name in line.parameters if name.startswith("J")]
    total = sum(line.parameters[name].value for name in names)
    return f"{' + '.join(names)} = {total:g} {parameter_unit(names[0], line.motion)}"


def _off_by_a_factor(record: Record, line: DrivelineModel, found: Inertia) -> Implausible:
    """Return the refusal of a recording that fits another inertia, with the factors that are close."""
    if found.ratio < 0.0:
        torque = "torque" if line.motion is Motion.ROTATION else "force"
        return Implausible(
            f"recording {record.name} is implausible: the output falls where the {torque} rises (an inertia "
            f"{times(found.ratio)} times the nominal {_nominal(line)} fits). Is the sign of {torque} or output turned "
            "round? Give one of them a negative scale in [signals].",
            Cure(record.name, output=-1.0),
        )
    near = close_factors(found.ratio, line.gear_ratio)[:NAMED]
    close = " ".join(f"This is close to {factor.said}" for factor in near)
    cures = [Cure(record.name, torque=factor.torque, output=factor.output) for factor in near[:1]]
    if not near and found.ratio < 1.0 and np.abs(record.torque_nm).max() <= MOST_PER_CENT:
        scale = float(f"{1.0 / found.ratio:.2g}")
        close = f"{UNKNOWN} Or is it per cent of a rated torque of about {scale / PER_CENT:.0f} Nm?"
        cures = [Cure(record.name, torque=scale)]
    return Implausible(
        f"recording {record.name} is implausible: it fits an inertia {times(found.ratio)} times the nominal "
        f"{_nominal(line)}, expected 1 within its tolerance and a factor of {BEYOND:g}. {close or UNKNOWN} "
        "Correct the scale in [signals] (a torque in per cent of a rated one needs one, too), or the inertia in the "
        "model file.",
        next((cure for cure in cures if cure != Cure(record.name)), None),
    )
