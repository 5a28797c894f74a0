"""The diagnosis in the words of a driveline engineer."""

from __future__ import annotations

from collections.abc import Sequence

from estimator.diagnosis.beyond import in_words
from estimator.diagnosis.judgement import Judgement
from estimator.diagnosis.phrases import PLACE_NAMES, law_in_words
from estimator.diagnosis.result import Fit, FoundEffect, UntestableEffect, Verdict
from estimator.diagnosis.selection import Selection
from estimator.diagnosis.trial import Trial
from estimator.physics.catalogue import EFFECTS


def statement(
    judgement: Judgement, effects: Sequence[FoundEffect], fit: Fit, untestable: Sequence[UntestableEffect]
) -> str:
    """Return one paragraph: verdict, figures, and what to do next."""
    parts = [_HEADLINES[judgement.verdict](judgement, effects, fit), *judgement.unconverged]
    if judgement.remaining is not None and judgement.verdict is Verdict.EXPLAINED:
        parts.append(
            f"A smaller remainder still follows {law_in_words(judgement.remaining.terms)} at the "
            f"{PLACE_NAMES[judgement.remaining.element]}: the law found is an approximation there."
        )
    twins = sorted({twin for effect in effects for twin in effect.indistinguishable_from})
    if twins:
        parts.append(f"From torque and speed alone this can't be told from {' or '.join(twins)}.")
    if testable := [entry for entry in untestable if not entry.needs]:
        tests = " or ".join(sorted({entry.suggested_test for entry in testable}))
        names = ", ".join(entry.name for entry in testable)
        parts.append(f"These recordings can't tell {names}; a {tests} test would.")
    parts += [f"Without {entry.needs}, {entry.name} can't be told." for entry in untestable if entry.needs]
    return " ".join(parts)


def _no_mismatch(judgement: Judgement, effects: Sequence[FoundEffect], fit: Fit) -> str:
    return (
        f"Nothing is missing: re-tuned inside its tolerances, the nominal model explains the recordings to the "
        f"noise (free-run error {fit.retuned:.3g} {fit.unit}, floor {fit.noise_floor:.3g} {fit.unit})."
    )


def _explained(judgement: Judgement, effects: Sequence[FoundEffect], fit: Fit) -> str:
    found = "; ".join(effect.statement for effect in effects)
    this, it = ("this", "it") if len(effects) == 1 else ("these", "them")
    return (
        f"The model leaves out {this}: {found}. With {it} the free-run error falls "
        f"from {fit.retuned:.3g} to {fit.augmented:.3g} {fit.unit}, on samples not used for the fit from "
        f"{fit.holdout_retuned:.3g} to {fit.holdout_augmented:.3g} {fit.unit}."
    )


def _unexplained(judgement: Judgement, effects: Sequence[FoundEffect], fit: Fit) -> str:
    left = f"{fit.retuned:.3g} {fit.unit} against a noise floor of {fit.noise_floor:.3g} {fit.unit}"
    if judgement.strays:
        return (
            f"Inside its tolerances the nominal model leaves {left}, but no physics need be missing: the same line "
            f"explains the recordings to the noise with {in_words(judgement.strays)}. Check the data sheet, or widen "
            "the tolerance where it is a guess, and diagnose again."
        )
    where = (
        f" It looks most like {law_in_words(judgement.unnamed.terms)} at the {PLACE_NAMES[judgement.unnamed.element]}."
        if judgement.unnamed is not None
        else ""
    )
    why = f" {judgement.objection[0].upper()}{judgement.objection[1:]}." if judgement.objection else ""
    return (
        f"There is a mismatch that no entry of the catalogue explains: the re-tuned nominal model leaves "
        f"{left}.{where}{why}"
    )


_HEADLINES = {
    Verdict.NO_MISMATCH: _no_mismatch,
    Verdict.EXPLAINED: _explained,
    Verdict.UNEXPLAINED: _unexplained,
}


def rejection(trial: Trial, selection: Selection) -> str:
    """Return why an effect that was fitted is not in the verdict."""
    if trial.failed is not None:
        return trial.failed
    retuned, best = selection.retuned.rms, selection.result.rms
    if not selection.chosen:
        return "its gain does not show on unseen data or is too small to see"
    special = [name for name in EFFECTS[trial.name].contains if name in selection.chosen]
    if special:
        return f"contains {special[0]}, and its further parameters add too little"
    others = sorted((trial.effects - {trial.name}) & selection.chosen)
    if others:
        more = max(best**2 - trial.result.rms**2, 0.0) / retuned**2
        beside = " and ".join(others)
        return f"beside {beside} it removes {more:.1%} more of the mismatch: too little, or not on unseen data"
    share = (retuned**2 - trial.result.rms**2) / (retuned**2 - best**2)
    return f"explains {max(share, 0.0):.0%} of what {' + '.join(sorted(selection.chosen))} explains"
