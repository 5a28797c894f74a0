"""Do recordings and model fit together? One table of candidates, asked once of all recordings before any fit.

Its odds (``odds``) decide what is doubted and what refused. A line that cures is handed out only where the table, asked
again with the line applied, finds nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.inference.wording import times as multiple
from estimator.diagnosis.preconditions.candidates import Line, Part, of_one_unit
from estimator.diagnosis.preconditions.inertia import (
    BODY,
    Inertia,
    fitted_inertia,
    held_by_friction,
    is_within_tolerance,
    ratio_off,
    tolerance_of,
)
from estimator.diagnosis.preconditions.odds import Candidate, changed_by, largest, with_odds
from estimator.diagnosis.priors import MistakePriors
from estimator.diagnosis.result import Doubt
from estimator.diagnosis.thresholds import Mistakes
from estimator.errors import Implausible
from estimator.physics.model import DrivelineModel, Motion, parameter_unit
from estimator.signals.record import OutputKind, Record


def doubts_about(records: Sequence[Record], model: DrivelineModel | None) -> list[Doubt]:
    """Ask the table of recordings of one drive, and of their model where there is one.

    Returns
    -------
    list of Doubt
        What recordings and model leave doubtful, the likeliest first; empty where they fit.

    Raises
    ------
    Implausible
        Where only a wrong unit, sign, column, period or model explains them.
    """
    for record in records:
        _require_plausible_load(record)
    line = None if model is None else replace(model, effects={})
    moving = [each for each in records if np.ptp(each.output[each.okay]) > 0.0]
    doubt, is_refused = _judged([_less_its_load(record) for record in moving], line)
    if doubt is not None and is_refused:
        raise Implausible(doubt.statement, doubt.cure)
    return [] if doubt is None else [doubt]


def _judged(records: Sequence[Record], line: Line, is_tried: bool = False) -> tuple[Doubt | None, bool]:
    """Return what is doubtful, if anything, and whether recordings are refused for it."""
    fits = [(record, fitted_inertia(record, line or BODY)) for record in records]
    # one that is too short for its line says nothing: a period that makes it longer would explain more of nothing
    long = [(record, each) for record, each in fits if line is None or not math.isnan(each.ratio)]
    if not long:
        return None, False
    records, found = [record for record, _ in long], [each for _, each in long]
    if line is not None and not _is_suspicious(_less_friction(records, found, line), line):
        return None, False
    ranked = with_odds(records, line, found)
    (best, odds), others = ranked[0], [each for each in ranked[1:] if not each[0].is_right]
    is_right = math.fsum(each for candidate, each in ranked if candidate.is_right)
    is_off = line is not None and any(each.tells and not _is_plausible(each, line) for each in found)
    is_clear = odds >= Mistakes.LIKELY and not (best.is_right or best.is_else)
    may_be_physics = best.is_a_factor or best.change.is_open or best.only is not None
    if best.is_right or is_right >= Mistakes.DOUBTFUL or (line is None and not is_clear):
        return None, False
    if best.is_else and not is_off:  # a road, a brake or a driver moved the line
        return None, False
    cure = None
    if is_clear and not is_tried and odds >= Mistakes.OVER_THE_NEXT * max((each for _, each in others), default=0.0):
        cure = best.cure(records[0])
        if cure is not None and not _passes(best, records, line, found):
            cure = None
    is_wrong = 1.0 - is_right - math.fsum(each for candidate, each in ranked if candidate.is_else)
    is_one_of_all = best.only is None and not best.change.is_open
    # a scale of any size may be physics, too, such as gravity: it is doubted, as an inertia next to another mistake is
    open_parts = {Part.TORQUE, Part.OUTPUT} | ({Part.MODEL} if best.change.question else set())
    is_of_any_size = any(row.low < row.high and not row.whole and row.part in open_parts for row, _ in best.rows)
    may_be_refused = is_one_of_all and not is_of_any_size
    fits_as_read = line is not None and any(is_within_tolerance(each, line) for each in found)
    is_sure = odds >= Mistakes.SURELY if fits_as_read else is_clear
    is_refused = may_be_refused and is_wrong >= Mistakes.SURELY and (is_off or (is_sure and not may_be_physics))
    if line is None and best.is_a_factor and not is_clear:
        return None, False
    about = ", ".join(record.name for record in _blamed(records, found, line, best))
    return Doubt(about, _text(records, line, found, ranked), 1.0 - is_right, cure=cure), is_refused


def _less_friction(records: Sequence[Record], found: Sequence[Inertia], line: DrivelineModel) -> list[Inertia]:
    """Return what recordings fit, those that tell nothing as what friction explains: it is no fault of theirs."""
    return [
        each if each.tells else held_by_friction(record, line) or each
        for record, each in zip(records, found, strict=True)
    ]


def _passes(best: Candidate, records: Sequence[Record], line: Line, found: Sequence[Inertia]) -> bool:
    """Tell whether with a candidate undone the table finds nothing, and no input alone in a unit explains more."""
    undone = best.undone(records)
    if _judged(undone, line, is_tried=True)[0] is not None:
        return False
    if line is None or not best.is_a_factor or all(row.low == row.high for row, _ in best.rows):
        return True
    rest = sum(fitted_inertia(record, line).rest for record in undone)
    of_one = of_one_unit(records[0], ratio_off(found, line)[0])
    return all(sum(fitted_inertia(changed_by(record, each), line).rest for record in records) > rest for each in of_one)


def _is_suspicious(found: Sequence[Inertia], line: DrivelineModel) -> bool:
    counted = [math.log(abs(each.ratio)) for each in found if each.tells]
    return (
        any(not each.tells or not is_within_tolerance(each, line) for each in found)
        or any(abs(each.log_ratio) > Mistakes.BANDS_BEYOND for each in found)
        or (bool(counted) and max(counted) - min(counted) > Mistakes.LEAST_LOG_RATIO)
    )


def _blamed(records: Sequence[Record], found: Sequence[Inertia], line: Line, best: Candidate) -> list[Record]:
    """Return the recordings that a doubt is about: that one, or those that do not fit; all where none is alone."""
    if best.only is not None:
        return [records[best.only]]
    off = [r for r, each in zip(records, found, strict=True) if line is None or not is_within_tolerance(each, line)]
    return off or list(records)


def _text(
    records: Sequence[Record], line: Line, found: Sequence[Inertia], ranked: Sequence[tuple[Candidate, float]]
) -> str:
    best = ranked[0][0]
    blamed = _blamed(records, found, line, best)
    shown = [each for record, each in zip(records, found, strict=True) if record in blamed]
    is_turn = line is None or line.motion is Motion.ROTATION
    torque = "torque" if is_turn else "force"
    falls = f"is the sign of {torque} or {'motion' if records[0].imposed is not None else 'output'} turned round"
    named = [
        f"{each.question(records, falls)} ({odds:.0%}{_follows(each, records, is_turn)})"
        for each, odds in ranked[: Mistakes.MOST_NAMED]
        if odds >= Mistakes.FEWEST_ODDS or each.is_else
    ]
    if not any(each.is_else for each, _ in ranked[: Mistakes.MOST_NAMED]):
        named.append("something else? (under 1%)")
    names = ", ".join(record.name for record in blamed)
    one = len(blamed) == 1
    return (
        f"recording{'' if one else 's'} {names} {'is' if one else 'are'} implausible: {_misfit(records, line, shown)}. "
        f"What would explain it, with its odds: {'; '.join(named)}. What the drive can do decides, and whose the model "
        "file is; scales and columns stand in [signals]."
    )


def _misfit(records: Sequence[Record], line: Line, shown: Sequence[Inertia]) -> str:
    """Say what does not fit."""
    counted = [each for each in shown if each.tells]
    most = max(largest(record)[1] for record in records)
    if line is None and records[0].kind is OutputKind.SPEED and most > MistakePriors.FASTEST_RAD_S:
        return f"a speed of {most:.0f} rad/s is more than a drive reaches"
    if line is None or not counted:
        return "the motion does not follow from the torque as read"
    torque = "torque" if line.motion is Motion.ROTATION else "force"
    ratios = ", ".join(multiple(each.ratio) for each in counted)
    if records[0].imposed is not None:
        return f"its {torque} is {ratios} times what the nominal k and c make of the motion, expected 1"
    falls = f"the {records[0].kind.value} falls where the {torque} rises, and " if counted[0].ratio < 0.0 else ""
    bands = [math.exp(each.log_ratio) for each in counted if abs(each.log_ratio) > Mistakes.BANDS_BEYOND]
    above = f"; above the first mode it fits {multiple(1.0 / bands[0])} times that" if bands else ""
    fits = "it fits an inertia" if len(counted) == 1 else "they fit inertias"
    expected = f"expected 1 within its tolerance and a factor of {Mistakes.BEYOND:g}"
    return f"{falls}{fits} {ratios} times the nominal {_nominal(line)}, {expected}{above}"


def _follows(candidate: Candidate, records: Sequence[Record], is_turn: bool) -> str:
    """Say which torques and speeds follow from a factor."""
    if not candidate.rows:
        return ""
    torque, unit = ("torque", "Nm") if is_turn else ("force", "N")
    read = np.max([largest(record) for record in records], axis=0)
    by_torque, by_output = candidate.factors()
    follows = f", {torque}s up to {by_torque * read[0]:.3g} {unit} then" if by_torque != 1.0 else ""
    return follows + (f", a {records[0].kind.value} up to {by_output * read[1]:.3g} then" if by_output != 1.0 else "")


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
    if load > Mistakes.MOST_LOAD * torque:
        raise Implausible(
            f"recording {record.name} is implausible: its measured load torque reaches {load:.3g} Nm, its torque "
            f"{torque:.3g} Nm. Is load in another unit, or not reflected to the motor shaft? Divide its scale in "
            "[signals] by the gear's ratio."
        )


def _is_plausible(found: Inertia, line: DrivelineModel) -> bool:
    """Tell whether an inertia is within reach of re-tuning, or of physics missing."""
    tolerance = tolerance_of(line)
    return (1.0 - tolerance) / Mistakes.BEYOND <= found.ratio <= (1.0 + tolerance) * Mistakes.BEYOND


def _nominal(line: DrivelineModel) -> str:
    names = [name for name in line.parameters if name.startswith("J")]
    total = sum(line.parameters[name].value for name in names)
    return f"{' + '.join(names)} = {total:g} {parameter_unit(names[0], line.motion)}"
