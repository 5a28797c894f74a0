"""The verdict: what the chosen effects, the rivals without a name and what remains add up to."""

from __future__ import annotations

from dataclasses import dataclass

from estimator.diagnosis.evidence import VERY_STRONG, gain
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.selection import Selection, counting_law
from estimator.diagnosis.unnamed import UnnamedLaw
from estimator.physics.catalogue import EFFECTS
from estimator.signals.record import OutputKind

MOST = 0.5
"""An explanation that leaves more of the mismatch's power standing than this is not one."""

ABOVE_FLOOR = 1.25
"""A re-tuned nominal model whose error is above the floor by this factor does not explain a speed recording: the
torque reading's own noise adds a few per cent, the estimate of the floor errs upward."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict and what it rests on.

    Attributes
    ----------
    unnamed : UnnamedLaw or None
        The best law without a name for what the re-tuned nominal leaves, where it counts.
    remaining : UnnamedLaw or None
        The best one for what the chosen effects leave, where it counts.
    objection : str
        Why chosen effects are not believed; empty where they are, or where there are none.
    """

    verdict: Verdict
    unnamed: UnnamedLaw | None
    remaining: UnnamedLaw | None
    objection: str = ""


def judge(selection: Selection, floor: float) -> Judgement:
    """Weigh the selection against laws without a name and against the noise floor."""
    unnamed = counting_law(selection.retuned)
    if not selection.chosen:
        standing = _above_floor(selection, floor) or unnamed is not None
        return Judgement(Verdict.UNEXPLAINED if standing else Verdict.NO_MISMATCH, unnamed, None)
    remaining = counting_law(selection.result)
    objection = _objection(selection, floor, unnamed, remaining)
    verdict = Verdict.UNEXPLAINED if objection else Verdict.EXPLAINED
    return Judgement(verdict, unnamed, remaining, objection)


def _above_floor(selection: Selection, floor: float) -> bool:
    speed = all(record.kind is OutputKind.SPEED for record in selection.retuned.problem.records)
    return speed and selection.retuned.rms > ABOVE_FLOOR * floor


def _objection(selection: Selection, floor: float, unnamed: UnnamedLaw | None, remaining: UnnamedLaw | None) -> str:
    before, after = selection.retuned.rms, selection.result.rms
    named = " and ".join(EFFECTS[name].title for name in sorted(selection.chosen))
    if before**2 - after**2 < MOST * (before**2 - min(floor, after) ** 2):
        return f"{named} would leave most of the mismatch standing"
    profiles = [name for name in selection.chosen if EFFECTS[name].profile]
    if profiles and len(selection.chosen) == 1 and remaining is not None:  # an edge in what should be smooth
        return f"{named} would leave {remaining.terms[0][0]} at the {remaining.element.value} unexplained"
    if unnamed is None:
        return ""
    elements = {EFFECTS[name].element for name in selection.chosen}
    rival_is_simpler = unnamed.gain.delta_bic > gain(selection.retuned, selection.result).delta_bic + VERY_STRONG
    if rival_is_simpler and (profiles or unnamed.element not in elements):
        return f"a law of {unnamed.terms[0][0]} at the {unnamed.element.value} explains it with less than {named}"
    return ""
