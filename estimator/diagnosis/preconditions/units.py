"""Units, signs and columns that a recording can't have: refused with the line that cures it, where that is clear."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.inference.wording import times
from estimator.diagnosis.preconditions.explanations import (
    CLOSE,
    FASTEST_S,
    LEAST_REST,
    PHYSICS,
    REST,
    RPM,
    SLOWEST_S,
    TIME_UNITS,
    Change,
    Explanation,
    changes_of,
    column_changes,
    explanations,
    largest,
    rows_for,
    usual,
)
from estimator.diagnosis.preconditions.inertia import BODY_TELLS, Inertia, as_one_body, fitted_inertia
from estimator.errors import BadModel, Cure, Implausible
from estimator.physics.layout import Grid, grid_for
from estimator.physics.model import DrivelineModel, Motion, Parameter, Structure, parameter_unit
from estimator.signals.record import FloatArray, OutputKind, Record

BEYOND = 2.5
"""Factor beyond an inertia's tolerance that is implausible: payloads, derating and closed clutches are less, the
smallest factor between units (3.6) is more."""

FAR_AHEAD, OVER_THE_NEXT = 0.5, 4.0
"""Odds of an explanation from which on the line that cures it is given, and how much larger than those of the next."""

DOUBTFUL = 0.3  # odds that nothing is wrong below which a recording whose inertia is plausible is doubted
FEWEST_ODDS, MOST_NAMED = 0.01, 7  # odds from which on an explanation is named, and how many are

MOST_LOAD = 10.0
"""Factor by which a load machine's torque may exceed all torque of the motor: more would turn the motor over."""

LIMITS = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.07, 0.05)
"""Limits of a torque that are tried, in its largest reading: what is read beyond is not there."""

DEPTHS, TIMES = (0.5, 0.8, 0.95), (0.05, 0.3, 1.0)
"""Losses of a torque over time that are tried, and their time constants in the recording's length."""

UNKNOWN_FIT = 1.0 / 6.0
"""Density of the inertia of a recording that does not tell it: anything from a twentieth to twenty times."""


def require_plausible_units(records: Sequence[Record], model: DrivelineModel) -> list[Implausible]:
    """Refuse recordings whose torque, output or time is off by a factor, in sign, or another column's."""
    for record in records:
        _require_plausible_load(record)
    refusal, doubts = _judged(records, replace(model, effects={}))
    if refusal is not None:
        raise refusal
    return doubts


def _judged(
    records: Sequence[Record], line: DrivelineModel, is_cured: bool = False
) -> tuple[Implausible | None, list[Implausible]]:
    """Return the refusal of the recording that tells most clearly, or what is doubtful; neither where all fit."""
    moving = [each for each in records if each.kind is not OutputKind.FORCE and np.ptp(each.output[each.okay]) > 0.0]
    judged = [_less_its_load(record) for record in moving]
    found = [(record, _inertia(record, line)) for record in judged]
    found = [(record, each) for record, each in found if each is None or not _is_within_tolerance(each, line)]
    doubts = []
    for record, each in sorted(found, key=lambda pair: 1.0 if pair[1] is None else -pair[1].share):
        is_off = each is not None and not _is_plausible(each, line)
        ranked = _ranked(record, line, each, is_off)
        (best, odds), next_odds = ranked[0], max((other for _, other in ranked[1:]), default=0.0)
        cure = best.cure if odds >= FAR_AHEAD and odds >= OVER_THE_NEXT * next_odds else None
        text = _text(record, line, each, ranked)
        is_right = math.fsum(each for explanation, each in ranked if explanation.is_physics)
        if not is_off and best.is_a_factor and each is not None and is_right < DOUBTFUL:
            doubts.append(Implausible(text, cure))
        if best.change.physics or not (is_off or (cure is not None and not best.is_a_factor)):
            continue
        if cure is not None and not is_cured:
            left, more = _judged([_cured(other, cure) for other in records], line, is_cured=True)
            text += "".join(f" With that corrected, {rest}" for rest in ([left] if left else more))
        return Implausible(text, cure), doubts
    return None, doubts


def _ranked(
    record: Record, line: DrivelineModel, found: Inertia | None, is_off: bool
) -> list[tuple[Explanation, float]]:
    """Return all explanations with their odds, the likeliest first; of the torque's path where the inertia is off."""
    tolerance, of_fit = CLOSE[0] * math.log1p(_tolerance(line)), CLOSE[1]
    rows = rows_for(line)
    all_of: list[Explanation] = []
    for change in changes_of(record):
        fitted = found if not change.question else _inertia(change.record, line)
        if fitted is not None and fitted.ratio != 0.0:
            all_of += explanations(change, fitted, rows, math.hypot(tolerance, of_fit))
        elif not change.question:
            torque, output = largest(record)
            weight = (
                change.prior * UNKNOWN_FIT * (1.0 - BODY_TELLS) ** -REST * usual((), torque, torque, output, record)
            )
            all_of.append(Explanation(change, (), weight, torque, output))
    if is_off:
        paths = [(change, _inertia(change.record, line)) for change in _of_the_torque_path(record)]
        named = [(change, each) for change, each in paths if each is not None and _is_plausible(each, line)]
        for change, each in sorted(named, key=lambda pair: -pair[1].share)[:1]:
            all_of += explanations(change, each, (), math.hypot(tolerance, of_fit, PHYSICS))
    total = math.fsum(each.weight for each in all_of) or 1.0
    return [(each, each.weight / total) for each in sorted(all_of, key=lambda each: -each.weight)]


def _text(
    record: Record, line: DrivelineModel, found: Inertia | None, ranked: Sequence[tuple[Explanation, float]]
) -> str:
    torque = "torque" if line.motion is Motion.ROTATION else "force"
    falls = f"is the sign of {torque} or output turned round"
    begin = "the motion does not follow from the torque as read"
    if found is not None:
        begin = (
            f"it fits an inertia {times(found.ratio)} times the nominal {_nominal(line)}, expected 1 within its "
            f"tolerance and a factor of {BEYOND:g}"
        )
        if found.ratio < 0.0:
            begin = f"the {record.kind.value} falls where the {torque} rises, and {begin}"
    named = [
        f"{each.question(falls)}? ({odds:.0%}{_follows(each, record, line)})"
        for each, odds in ranked[:MOST_NAMED]
        if odds >= FEWEST_ODDS
    ]
    decides = "What the drive can do decides, and whose the model file is" if len(named) > 1 else "Correct that"
    return (
        f"recording {record.name} is implausible: {begin}. What would explain it, with its odds: {'; '.join(named)}. "
        f"{decides}; scales and columns stand in [signals]."
    )


def _follows(explanation: Explanation, record: Record, line: DrivelineModel) -> str:
    torque, unit = ("torque", "Nm") if line.motion is Motion.ROTATION else ("force", "N")
    read_nm, read = largest(record)
    follows = f", {torque}s up to {explanation.torque_nm:.3g} {unit} then" if explanation.torque_nm != read_nm else ""
    if explanation.output != read and explanation.change.record.kind is record.kind:
        follows += f", a {record.kind.value} up to {explanation.output:.3g} then"
    return follows


def _cured(record: Record, cure: Cure) -> Record:
    if cure.swapped is not None or cure.kind is not None:
        same = (
            change
            for change in column_changes(record)
            if (change.cure.swapped, change.cure.kind) == (cure.swapped, cure.kind)
        )
        record = next(same).record
    count = record.torque_nm.shape[1]
    inputs = np.isin(np.arange(count), cure.inputs or range(count))
    return replace(
        record,
        torque_nm=record.torque_nm * np.where(inputs, cure.torque, 1.0),
        output=record.output * cure.output,
        time_s=record.time_s * cure.time,
        sample_time_s=record.sample_time_s * cure.time,
    )


def _less_its_load(record: Record) -> Record:
    """Return a recording with a measured load torque taken off the first input: as a whole a line moves under both."""
    if record.load_nm is None:
        return record
    torque = record.torque_nm.copy()
    torque[:, 0] -= record.load_nm
    return replace(record, torque_nm=torque, load_nm=None)


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


FASTEST_RAD_S = 2500.0
"""Speed of a traction motor that is not reached: 24,000 rpm. A speed in rpm is."""

ALONE = 0.75  # odds from which on a recording is refused by itself

SLOWEST_LOGGED_S = 5.0
"""Vehicles are logged once a second by telemetry; slower than this, a time in milliseconds is more likely."""

_BODY = DrivelineModel(Structure.ONE_MASS, {"J_M": Parameter(1.0, 0.0), "b_M": Parameter(0.0, 0.0)})


def require_plausible_alone(record: Record) -> None:
    """Refuse a recording whose columns are swapped, or off in sign or by a unit, whatever the model is."""
    _require_plausible_period(record)
    if record.kind is OutputKind.FORCE:
        return
    fastest = float(np.abs(record.output[record.okay]).max())
    if record.kind is OutputKind.SPEED and fastest > FASTEST_RAD_S:
        raise Implausible(
            f"recording {record.name}: a speed of {fastest:.0f} rad/s is more than a drive reaches. Is it in rpm?",
            Cure(record.name, output=RPM),
        )
    weights: list[tuple[float, Change]] = []
    for change in (Change(record), *column_changes(record)):
        found = as_one_body(change.record, _BODY, 0.0)
        is_clear = found.share >= BODY_TELLS
        if is_clear and found.ratio < 0.0 and not change.question:
            falls = f"does the {record.kind.value} fall where the torque rises: is the sign of one of them turned round"
            change = Change(record, 1.0, falls, Cure(record.name, output=-1.0))
        if not change.question or (is_clear and (found.ratio > 0.0) == (change.cure.output > 0.0)):
            weights.append((change.prior * max(1.0 - found.share, LEAST_REST) ** -REST, change))
    weight, best = max(weights, key=lambda pair: pair[0])
    if best.question and weight > ALONE * math.fsum(each for each, _ in weights):
        raise Implausible(f"recording {record.name}: {best.question}?", best.cure)


def _require_plausible_period(record: Record) -> None:
    """Refuse a period at which nobody sees a driveline, where another unit of time makes it a usual one."""
    period_s = record.sample_time_s
    if FASTEST_S <= period_s <= SLOWEST_LOGGED_S:
        return
    for factor, unit in TIME_UNITS.items():
        if FASTEST_S < factor * period_s <= SLOWEST_S:
            raise Implausible(
                f"recording {record.name}: sampled every {period_s:.3g} s, no driveline is. Is time in {unit}, "
                f"expected s? Then it is {factor * period_s:.3g} s.",
                Cure(record.name, time=factor),
            )


def _of_the_torque_path(record: Record) -> Iterator[Change]:
    for torque in _lessened(record):
        lessened = replace(record, torque_nm=torque)
        question = "does the torque stop at a limit, or is it lost over time"
        yield Change(lessened, 0.1, question, factors=0, physics=True)


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


def _grid_or_none(record: Record, line: DrivelineModel) -> Grid | None:
    """Return how a line is simulated; None where its modes can't be with the recording."""
    try:
        return grid_for(line, [record])
    except BadModel:
        return None


def _inertia(record: Record, line: DrivelineModel) -> Inertia | None:
    """Return the inertia that a recording fits; only as one body where the line's modes can't be simulated with it."""
    return fitted_inertia(record, line, _grid_or_none(record, line))


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
