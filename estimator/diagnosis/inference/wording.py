"""A decision in the words of a driveline engineer."""

from __future__ import annotations

import math
from collections.abc import Sequence

from estimator.diagnosis.inference.data_sheet import in_words
from estimator.diagnosis.inference.remainder import Test
from estimator.diagnosis.inference.verdict import Decision
from estimator.diagnosis.phrases import times
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
        parts.append(f"Seen, but too small to matter: {', '.join(each.name for each in decision.traces)}.")
    twins = sorted({twin for effect in effects for twin in effect.indistinguishable_from})
    if twins:
        parts.append(f"These recordings could as well be explained by {' or '.join(twins)}.")
    tests = sorted({entry.suggested_test for entry in untestable if not entry.needs})
    if tests:
        names = ", ".join(entry.name for entry in untestable if not entry.needs)
        parts.append(f"Neither found nor excluded by these recordings: {names}. Record a {' or a '.join(tests)}.")
    parts += [f"Neither found nor excluded without {e.needs}: {e.name}." for e in untestable if e.needs]
    return " ".join(parts)


def _sure(effects: Sequence[FoundEffect]) -> str:
    """Say how probable the least probable of the effects is; nothing of faults that are seen in the readings."""
    least = min((each.probability for each in effects if not math.isnan(each.probability)), default=math.nan)
    if math.isnan(least):
        return ""
    return f" (probability {least:.3f})" if least < SURE else f" (probability above {SURE})"


def _errors(fit: Fit) -> str:
    """Say what the re-tuned nominal model leaves."""
    return f"a free-run error of {fit.retuned:.3g} {fit.unit} at a noise of {fit.noise_floor:.3g} {fit.unit}"


def _wrong_values(fit: Fit, strays: Sequence[Stray]) -> str:
    return (
        f"No physics need be missing, but the data sheet is off: with {in_words(strays)} the nominal model explains "
        f"the recordings down to the noise. Inside its tolerances it leaves {_errors(fit)}. Check the data sheet, or "
        "widen the tolerance where it is a guess, and diagnose again."
    )


def tests_in_words(failed: Sequence[Test]) -> str:
    """Say what an error does that noise does not, as the end of a sentence that begins with "it"."""
    names = [test.name for test in failed]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _left(decision: Decision, remainder: Remainder) -> str:
    share, noise = f"{remainder.share:.0%}".replace("%", " %"), times(remainder.times_noise)
    law = "" if remainder.element is None else f"; it {remainder.law}"
    return (
        f"{share} of the squared error is left, {noise} times the noise, and it is not noise: it "
        f"{tests_in_words(decision.failed)}{law}."
    )


def _headline(decision: Decision, effects: Sequence[FoundEffect], fit: Fit) -> str:
    is_fixed = decision.nothing.plain.problem.grid.plant is not None
    model = "the model" if is_fixed else "re-tuned inside its tolerances, the nominal model"
    if decision.verdict is Verdict.NO_MISMATCH:
        return (
            f"Nothing is missing: {model} leaves nothing but the noise and slow drift of the readings (free-run error "
            f"{fit.retuned:.3g} {fit.unit}, noise {fit.noise_floor:.3g} {fit.unit})."
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
        f"Something is missing in the model, and no effect of the catalogue explains it: {model} leaves {_errors(fit)}."
    )
