"""A statement says what its numbers say."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace

import pytest

from estimator.diagnosis.inference.decide import verdict_of
from estimator.diagnosis.inference.wording import Context, statement
from estimator.diagnosis.result import Counted, Effort, Evidence, Fit, FoundEffect, Remainder, Verdict
from estimator.physics.effect import Element

ERRORS = (0.0499, 0.05, 35.5, 35.50001)
EFFORTS = (Effort(), Effort("quick", 10, False, ("backlash", "gravity"), 40, 1.0))


def effect(name: str, counted: Counted | None) -> FoundEffect:
    evidence = Evidence(10.0, 1.0, 0.5, 1e-9)
    found = FoundEffect(name, Element.SHAFT, f"there is {name}", {}, {}, (), evidence, share=0.9)
    return found if counted is None else replace(found, counted=counted, probability=counted.probability)


COUNT = Counted(19, 20)
EFFECTS = (
    (),
    (effect("backlash", COUNT),),
    (effect("gravity", Counted(99, 99)), effect("backlash", COUNT)),  # the least sure one is said
    (effect("stale_samples", None),),
)


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
    verdict = verdict_of(0.1, bool(effects), left is not None)
    remainder = None if left is None else Remainder(left, 3.0, None, None, "has a line in its spectrum")
    said = statement(verdict, fit, effects, effort, Context(remainder))
    assert said.startswith("Not decided") is not effort.finished
    is_counted = any(each.counted == COUNT for each in effects)
    is_explained = verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED)
    assert ("This explains" in said) is (is_explained and effort.finished)
    assert ("Missing in the model" in said) is (is_explained and effort.finished)
    for moves, before, after in re.findall(r"(falls|rises) from (\S+) to (\S+)", said):
        assert (float(after) < float(before)) is (moves == "falls")
    assert ("19 of 20 such names were right" in said) is (is_counted and is_explained and effort.finished)
    assert "of the squared error is left" not in said or verdict is Verdict.PARTLY_EXPLAINED
    assert ("Nothing is missing" in said) is (verdict is Verdict.NO_MISMATCH and effort.finished)
    if not effort.finished:
        assert "after 1 s, 2 of 40 effects untried, among them backlash in the shaft line, gravity" in said
