"""Reads a diagnosis back: whatever its statement and its lists say is held against its own numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest

from estimator.diagnosis.result import Diagnosis, Verdict
from estimator.diagnosis.wording import times

NUMBER = r"(-?[\d.]+(?:e[+-]?\d+)?)"


def near(text: str, value: float) -> bool:
    """Tell whether a number of a sentence is this one, to the three digits that sentences have."""
    return float(text) == pytest.approx(value, rel=5e-3)


def contradictions(found: Diagnosis) -> list[str]:
    """Return every sentence that says another thing than the numbers; none where all is well."""
    return [*_errors(found), *_drawn(found), *_what_is_left(found), *_names(found), *_lists(found), *_rejected(found)]


def _errors(found: Diagnosis) -> Iterator[str]:
    fit, said, unit = found.fit, found.statement, re.escape(found.fit.unit)
    table = found.table
    known = [(fit.retuned, fit.augmented), (fit.holdout_retuned, fit.holdout_augmented)]
    known += [] if table is None else [(table.rms_before, table.rms_after)]
    for move, before, after in re.findall(f"(falls|rises)(?: with it)? from {NUMBER} to {NUMBER} {unit}", said):
        # of the names alone the error is larger than that of the augmented model, where a law without a name is in it
        is_known = any(near(before, was) and near(after, now) for was, now in known)
        is_before_the_law = table is not None and any(near(before, was) and float(after) > now for was, now in known)
        if not is_known and not is_before_the_law:
            yield f"the error {move} from {before} to {after}: no fit has these"
        if (float(after) < float(before)) is not (move == "falls"):
            yield f"the error {move} from {before} to {after}"
        if move == "rises" and found.verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED):
            yield f"{found.verdict.value}, and the error rises from {before} to {after}"
    for error, noise in re.findall(f"free-run error(?: of)? {NUMBER} {unit}(?: at a noise of|, noise) {NUMBER}", said):
        if not near(error, fit.retuned) or not near(noise, fit.noise_floor):
            yield f"an error of {error} at a noise of {noise}: {fit.retuned} and {fit.noise_floor}"


def _drawn(found: Diagnosis) -> Iterator[str]:
    """Hold what is drawn of the recordings against the errors in figures."""
    drawn = [each for each in found.traces if not each.holdout]
    lost = any(each.name == "lost_samples" for each in found.effects)  # drawn, and no error of the augmented model
    for model in ("retuned",) if lost else ("retuned", "augmented"):
        errors = [(getattr(each, model) - each.measured)[each.okay] for each in drawn]
        if errors and (rms := float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))) != pytest.approx(
            getattr(found.fit, model), rel=1e-6
        ):
            yield f"{model}: drawn with an error of {rms}, and the fit says {getattr(found.fit, model)}"


def _what_is_left(found: Diagnosis) -> Iterator[str]:
    left = found.remainder
    for less, share in re.findall(r"(Less than )?(\d+) % of the squared error is left", found.statement):
        if left is None or abs(0.0 if less else float(share) - 100.0 * left.share) > 0.5 + 1e-9:
            yield f"{share} % is left: {left}"
        if found.verdict is not Verdict.PARTLY_EXPLAINED:
            yield f"{share} % is left, and the verdict is {found.verdict.value}"
    for many in re.findall(r"([\d.,]+) times the noise", found.statement):
        if left is None or many != times(left.times_noise):
            yield f"{many} times the noise: {left}"
        elif found.table is None and not near(many, found.fit.augmented / found.fit.noise_floor):
            yield f"{many} times the noise, and the augmented model leaves {found.fit}"


def _names(found: Diagnosis) -> Iterator[str]:
    said = found.statement
    names = {each.name for each in found.effects}
    for effect in found.effects:
        if effect.statement not in said:
            yield f"{effect.name} is named and not in the statement"
        if effect.counted is not None and effect.probability > effect.counted.right / effect.counted.of:
            yield f"{effect.name}: {effect.probability} is more than was counted"
    tables = set() if found.table is None else {f"table_{found.table.place}"}
    in_model = set(found.augmented.effects) - tables
    if twice := (names | in_model) & {each.name for each in (*found.rejected, *found.refinements)}:
        yield f"in the model and out of it: {', '.join(sorted(twice))}"
    if ("Not established, and not in the model: " in said) is not bool(found.refinements):
        yield f"refinements: {found.refinements}"
    if found.traces[0].torque_nm.shape[1] == 1:
        shown = {each.name for each in (*found.effects, *found.rejected, *found.refinements, *found.slight)}
        if "inverter_gain_mismatch" in shown or re.search(r"\b(inverters? m[12]|in m2)\b", said):
            yield "a second inverter, where one input is read"


def _lists(found: Diagnosis) -> Iterator[str]:
    """Hold the lists of a diagnosis against each other."""
    for name, parameter in found.parameters.items():
        is_as_found = found.table is None  # next to a law without a name the model's values are others
        if is_as_found and found.augmented.parameters[name].value != pytest.approx(parameter.value):
            yield f"{name}: {parameter}, and in the model {found.augmented.parameters[name]}"
    if both := {each.name for each in found.effects} & {each.name for each in found.untestable}:
        yield f"named, and neither found nor excluded: {', '.join(sorted(both))}"


def _rejected(found: Diagnosis) -> Iterator[str]:
    for each in found.rejected:
        if "better by" in each.reason or each.delta_bic > 0.0:
            yield f"{each.name} is rejected: {each.reason} ({each.delta_bic:+.3g})"
        for left in re.findall(rf"it leaves {NUMBER} times the error of what is believed", each.reason):
            if float(left) < 1.0 and ": less, but" not in each.reason:
                yield f"{each.name} is rejected: {each.reason}"
