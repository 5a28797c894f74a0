"""Do recordings and model fit together? What is doubtful is said before any fit, and what can't be of a drive refused.

One table of candidates (`candidates.py`) is asked of all recordings; its odds (`odds.py`) decide what is doubted and
what refused. A line that cures is handed out only where the table, asked again with the line applied, finds nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.acquisition.chain import without_lost_samples
from estimator.diagnosis.preconditions.agreement import disagreements
from estimator.diagnosis.preconditions.candidates import Line
from estimator.diagnosis.preconditions.channels import with_motion_corrected
from estimator.diagnosis.preconditions.inertia import (
    Inertia,
    is_plausible,
    is_within_tolerance,
)
from estimator.diagnosis.preconditions.odds import Candidate, Judgement, judged, largest
from estimator.diagnosis.priors import MistakePriors
from estimator.diagnosis.result import Doubt
from estimator.diagnosis.segments import segments, thinned
from estimator.diagnosis.thresholds import Mistakes
from estimator.diagnosis.wording import times as multiple
from estimator.errors import Implausible
from estimator.physics.model import DrivelineModel, Motion, parameter_unit
from estimator.signals.record import OutputKind, Record, sliced


def doubtful(records: Sequence[Record], model: DrivelineModel | None) -> list[Doubt]:
    """Ask of recordings as they were read whether they can be of one drive, and of a model where there is one.

    The longest stretch of each is asked; where units and signs leave no doubt, also whether they are of one line.
    Raises `Implausible` where they can't be of a drive.
    """
    corrected, _ = with_motion_corrected(records)
    thin_ones = corrected if model is None else thinned(corrected, model)
    longest = [_longest(record) for record in thin_ones]
    doubts = doubts_about(without_lost_samples(longest), model)
    if doubts or model is None:
        return doubts
    return disagreements(without_lost_samples([_longest(record) for record in corrected]), model)


def _longest(record: Record) -> Record:
    return sliced(record, max(segments(record), key=lambda rows: int(record.okay[rows].sum())))


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
    moving = [_less_its_load(each) for each in records if np.ptp(each.output[each.okay]) > 0.0]
    found = judged(moving, line)
    if found is None:
        return []
    statement = _text(found, line)
    if found.is_refused:
        raise Implausible(statement, found.cure)
    about = ", ".join(record.name for record in _blamed(found, line))
    return [Doubt(about, statement, 1.0 - found.is_right, cure=found.cure)]


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


def _less_its_load(record: Record) -> Record:
    """Return a recording with a measured load torque taken off the first input: as a whole a line moves under both."""
    if record.load_nm is None:
        return record
    torque = record.torque_nm.copy()
    torque[:, 0] -= record.load_nm
    return replace(record, torque_nm=torque, load_nm=None)


def _blamed(found: Judgement, line: Line) -> list[Record]:
    """Return the recordings that a doubt is about: that one, or those that do not fit; all where none is alone."""
    records = found.seen.records
    if found.best.only is not None:
        return [records[found.best.only]]
    fits = zip(records, found.seen.found, strict=True)
    return [r for r, each in fits if line is None or not is_within_tolerance(each, line)] or list(records)


def _text(found: Judgement, line: Line) -> str:
    records, ranked, blamed = found.seen.records, found.ranked, _blamed(found, line)
    shown = [each for record, each in zip(records, found.seen.found, strict=True) if record in blamed]
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
        f"recording{'' if one else 's'} {names} {'is' if one else 'are'} implausible: "
        f"{_misfit(records, line, shown, found.seen.found)}. "
        f"What would explain it, with its odds: {'; '.join(named)}. What the drive can do decides, and whose the model "
        "file is; scales and columns stand in [signals]."
    )


def _misfit(records: Sequence[Record], line: Line, shown: Sequence[Inertia], found: Sequence[Inertia]) -> str:
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
    others = [each.ratio for each in found if each.tells and each not in shown]
    if others and all(is_plausible(each, line) for each in counted):  # each by itself could be: it is not one vehicle
        expected = f"expected what the others fit, {', '.join(map(multiple, others))}"
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


def _nominal(line: DrivelineModel) -> str:
    names = [name for name in line.parameters if name.startswith("J")]
    total = sum(line.parameters[name].value for name in names)
    return f"{' + '.join(names)} = {total:g} {parameter_unit(names[0], line.motion)}"
