"""A statement says what its numbers say."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace

import pytest

from estimator.diagnosis.inference.decide import verdict_of
from estimator.diagnosis.result import Counted, Effort, Evidence, Fit, FoundEffect, Remainder, Verdict
from estimator.diagnosis.wording import Context, statement
from estimator.physics.catalogue import title_of
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


def test_an_unexplained_statement_says_which_effects_were_not_fitted_and_how_one_is() -> None:
    fit = Fit("rad/s", 1.0, 0.9, 0.9, 0.9, 0.9, 0.05)
    left = Context(Remainder(1.0, 18.0, None, None, "has a line in its spectrum"))
    said = statement(Verdict.UNEXPLAINED, fit, (), Effort(untried=("gravity", "eddy_drag")), left)
    assert "no effect that was fitted explains it" in said
    assert (
        f"Not all effects were fitted, and one of these may be the cause: {title_of('gravity')}, drag that levels off."
        in said
    )
    assert "[effects.gravity]" in said
    assert "Not all effects were fitted" not in statement(Verdict.UNEXPLAINED, fit, (), Effort(), left)


def test_a_name_that_is_often_wrong_is_said_with_a_probably_and_its_share() -> None:
    fit = Fit("rad/s", 1.0, 0.9, 0.05, 0.9, 0.05, 0.05)
    unsure, sure = effect("backlash", Counted(18, 22)), effect("gravity", Counted(85, 86))
    alone = statement(Verdict.EXPLAINED, fit, (unsure,), Effort())
    assert alone.startswith("Missing in the model, probably (18 of 22 such names were right: 82 %): there is")
    both = statement(Verdict.EXPLAINED, fit, (sure, unsure), Effort())
    assert "(18 of 22 such names were right: 82 %, each by itself)" in both
    assert statement(Verdict.EXPLAINED, fit, (sure,), Effort()).startswith("Missing in the model (85 of 86")


def test_two_places_that_differ_are_both_said() -> None:
    fit = Fit("rad/s", 1.0, 0.9, 0.9, 0.9, 0.9, 0.05)
    left = Remainder(1.0, 18.0, Element.SHAFT, None, "has a line in its spectrum")
    both = Context(left, element=Element.SHAFT, alone=Element.LOAD)
    said = statement(Verdict.UNEXPLAINED, fit, (), Effort(), both)
    assert "Most likely it acts in the shaft; an input by itself would most likely act at the load." in said
    alike = statement(Verdict.UNEXPLAINED, fit, (), Effort(), replace(both, alone=Element.SHAFT))
    assert "Most likely it acts in the shaft." in alike
