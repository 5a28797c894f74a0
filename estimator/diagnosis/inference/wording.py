"""A decision in the words of a driveline engineer."""

from __future__ import annotations

import math
from collections.abc import Sequence

from estimator.diagnosis.inference.data_sheet import in_words
from estimator.diagnosis.inference.verdict import Decision
from estimator.diagnosis.phrases import PLACE_NAMES, times
from estimator.diagnosis.result import Fit, FoundEffect, Remainder, Stray, UntestableEffect, Verdict

SURE = 0.999
"""Probability from which a sentence gives no more digits."""


def statement(
    decision: Decision,
    effects: Sequence[FoundEffect],
    fit: Fit,
    untestable: Sequence[UntestableEffect],
    remainder: Remainder | None,
    strays: Sequence[Stray] = (),
) -> str:
    """Return one paragraph: verdict, figures, and what to do next."""
    parts = [_wrong_values(fit, strays) if strays else _headline(decision, effects, fit)]
    if remainder is not None and not strays:
        parts.append(_left(decision, remainder))
    if decision.traces:
        parts.append(f"Too small to count, but seen: {', '.join(each.name for each in decision.traces)}.")
    twins = sorted({twin for effect in effects for twin in effect.indistinguishable_from})
    if twins:
        parts.append(f"From these recordings this can't be told from {' or '.join(twins)}.")
    tests = sorted({entry.suggested_test for entry in untestable if not entry.needs})
    if tests:
        names = ", ".join(entry.name for entry in untestable if not entry.needs)
        parts.append(f"These recordings can't tell {names}; a {' or '.join(tests)} test would.")
    parts += [f"Without {entry.needs}, {entry.name} can't be told." for entry in untestable if entry.needs]
    return " ".join(parts)


def _sure(effects: Sequence[FoundEffect]) -> str:
    """Say how probable the least probable of the effects is; nothing of faults that are seen in the readings."""
    least = min((each.probability for each in effects if not math.isnan(each.probability)), default=math.nan)
    if math.isnan(least):
        return ""
    return f" (probability {least:.3f})" if least < SURE else f" (probability above {SURE})"


def _wrong_values(fit: Fit, strays: Sequence[Stray]) -> str:
    left = f"{fit.retuned:.3g} {fit.unit} against a noise of {fit.noise_floor:.3g} {fit.unit}"
    return (
        f"Inside its tolerances the nominal model leaves {left}, but no physics need be missing: the same line "
        f"explains the recordings to the noise with {in_words(strays)}. Check the data sheet, or widen the tolerance "
        "where it is a guess, and diagnose again."
    )


def _left(decision: Decision, remainder: Remainder) -> str:
    law = ""
    if remainder.element is not None:
        law = f", and looks most like {remainder.law} at the {PLACE_NAMES[remainder.element]}"
    return (
        f"What is left, {times(remainder.times_noise)} times the reading's noise, is more than noise and drift: it is "
        f"{', '.join(test.name for test in decision.failed)}{law}."
    )


def _headline(decision: Decision, effects: Sequence[FoundEffect], fit: Fit) -> str:
    if decision.verdict is Verdict.NO_MISMATCH:
        return (
            "Nothing is missing: re-tuned inside its tolerances, the nominal model leaves nothing but the noise and "
            f"slow drift of the readings (free-run error {fit.retuned:.3g} {fit.unit}, noise {fit.noise_floor:.3g} "
            f"{fit.unit})."
        )
    if effects:
        found = "; ".join(effect.statement for effect in effects)
        part = "part of the mismatch" if decision.verdict is Verdict.PARTLY_EXPLAINED else "the mismatch"
        return (
            f"Missing in the model{_sure(effects)}: {found}. This explains {part}: the free-run error falls from "
            f"{fit.retuned:.3g} to {fit.augmented:.3g} {fit.unit}, on samples not used for the fit from "
            f"{fit.holdout_retuned:.3g} to {fit.holdout_augmented:.3g} {fit.unit}."
        )
    return (
        f"There is a mismatch that no entry of the catalogue explains: the re-tuned nominal model leaves "
        f"{fit.retuned:.3g} {fit.unit} against a noise of {fit.noise_floor:.3g} {fit.unit}."
    )
