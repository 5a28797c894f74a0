"""No statement contradicts the numbers next to it, whatever they are."""

from __future__ import annotations

import itertools
import math
import re

import pytest

from estimator.diagnosis.inference.judge import error_falls, verdict_of
from estimator.diagnosis.inference.wording import Context, statement
from estimator.diagnosis.result import Effort, Evidence, Fit, FoundEffect, OffNominal, Remainder, Verdict
from estimator.physics.effect import Element

ERRORS = (0.0499, 0.05, 35.5, 35.50001)
EFFORTS = (Effort(), Effort("quick", 10, False, ("backlash", "gravity"), 40, 1.0))


def effect(name: str, probability: float) -> FoundEffect:
    evidence = Evidence(10.0, 1.0, 0.5, 1e-9)
    return FoundEffect(
        name, Element.SHAFT, f"there is {name}", {}, {}, (), evidence, share=0.9, probability=probability
    )


EFFECTS = ((), (effect("backlash", 0.95),), (effect("backlash", 1.0), effect("stale_samples", math.nan)))


@pytest.mark.parametrize(("effects", "effort", "left"), list(itertools.product(EFFECTS, EFFORTS, (None, 0.0, 1.0))))
def test_a_statement_says_what_its_numbers_say(
    effects: tuple[FoundEffect, ...], effort: Effort, left: float | None
) -> None:
    for errors in itertools.product(ERRORS, repeat=4):
        says_what_its_numbers_say(errors, effects, effort, left)


def says_what_its_numbers_say(
    errors: tuple[float, ...], effects: tuple[FoundEffect, ...], effort: Effort, left: float | None
) -> None:
    retuned, augmented, held_before, held_after = errors
    fit = Fit("rad/s", retuned, retuned, augmented, held_before, held_after, 0.05)
    verdict = verdict_of(0.1, bool(effects), left is not None, error_falls(fit))
    remainder = None if left is None else Remainder(left, 3.0, None, None, "has a line in its spectrum")
    said = statement(verdict, fit, effects, effort, Context(remainder))
    assert said.startswith("Not decided") is not effort.finished
    is_explained = verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED)
    assert ("This explains" in said) is (is_explained and effort.finished)
    assert ("Missing in the model" in said) is (is_explained and effort.finished)
    assert "rises" not in said
    for before, after in re.findall(r"falls from (\S+) to (\S+)", said):
        assert float(after) < float(before)
    assert "of the squared error is left" not in said or verdict is Verdict.PARTLY_EXPLAINED
    assert ("Nothing is missing" in said) is (verdict is Verdict.NO_MISMATCH and effort.finished)
    if not effort.finished:
        assert "after 1 s, 2 of 40 effects untried, among them backlash, gravity" in said


def test_a_constant_off_its_sheet_is_said_as_such() -> None:
    fit = Fit("rad/s", 2.0, 1.0, 1.0, 1.0, 1.0, 0.05)
    said = statement(
        Verdict.UNEXPLAINED, fit, (), Effort(), Context(off_nominal=(OffNominal("J_L", 1.34, 0.2, 105.0, "kg m^2"),))
    )
    assert "J_L is 141 kg m^2, the data sheet says 105 ± 20 %" in said
