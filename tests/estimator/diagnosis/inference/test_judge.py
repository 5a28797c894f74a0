"""Shares add up to what is explained; a probability sums over all sets that hold an effect."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import pytest

from estimator.diagnosis.inference import checks
from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.inference.judge import (
    Score,
    levels,
    probability_of,
    shares,
    shares_with_grade,
    tempered_by,
    verdict_of,
)
from estimator.diagnosis.result import Verdict


@dataclass
class Left:
    """A set of effects and the squared free-run error that it leaves."""

    effects: frozenset[str] = field(default_factory=frozenset)
    free_squares: float = 0.0


def path(*steps: tuple[str, float]) -> list[Hypothesis]:
    return [cast(Hypothesis, Left(frozenset(names.split()), squares)) for names, squares in steps]


def test_each_effect_has_what_is_left_less_from_where_it_was_added() -> None:
    found = shares(path(("", 100.0), ("lag", 40.0), ("lag brake", 10.0)))
    assert found == pytest.approx({"lag": 0.6, "brake": 0.3})


def test_an_effect_that_takes_anothers_place_has_its_share_too() -> None:
    found = shares(path(("", 100.0), ("lag", 40.0), ("lag brake", 10.0), ("lag payload", 5.0)))
    assert found == pytest.approx({"lag": 0.6, "payload": 0.35})


def test_a_step_without_a_new_effect_changes_all_in_proportion() -> None:
    written_another_way = shares(path(("", 100.0), ("lag", 60.0), ("lag brake", 40.0), ("lag brake", 10.0)))
    assert written_another_way == pytest.approx({"lag": 0.6, "brake": 0.3})
    dropped = shares(path(("", 100.0), ("lag", 60.0), ("lag brake", 40.0), ("brake", 41.0)))
    assert dropped == pytest.approx({"brake": 0.59})


def test_a_set_leaves_no_more_than_one_that_it_holds() -> None:
    """However poor the least-squares fit of the larger one is: what it does not gain is not shared out either."""
    assert levels(path(("", 100.0), ("lag", 10.0), ("lag brake", 60.0), ("brake", 50.0))) == [100.0, 10.0, 10.0, 50.0]
    assert shares(path(("", 100.0), ("lag", 10.0), ("lag brake", 60.0), ("lag brake slip", 40.0))) == pytest.approx(
        {"lag": 0.9, "brake": 0.0, "slip": 0.0}
    )


def test_a_grade_has_what_no_other_effect_is_needed_for() -> None:
    """A brake that was found before the grade leaves hardly more without it: the error goes with the grade."""
    nothing, best = path(("", 100.0), ("brake lag road_grade", 4.0))
    without = path(("lag road_grade", 4.1), ("brake road_grade", 34.0), ("brake lag", 30.0))
    visited = {each.effects: each for each in without}
    found = shares_with_grade(best, visited, nothing)
    assert found == pytest.approx({"brake": 0.001, "lag": 0.3, "road_grade": 0.659})


def test_without_effects_nothing_is_shared_out() -> None:
    assert shares(path(("", 100.0))) == {}


def test_a_probability_sums_over_all_sets_that_hold_the_effect_or_a_look_alike() -> None:
    sets = {"": 6.0, "lag": 0.0, "filter": 0.0, "brake lag": 0.0}
    scores = [Score(frozenset(effects.split()), score) for effects, score in sets.items()]
    one = probability_of({"lag"}, scores, 1.0)
    assert one == pytest.approx(2.0 / (3.0 + 0.0498), rel=1e-3)
    assert probability_of({"lag", "filter"}, scores, 1.0) > one
    assert probability_of({"lag", "filter"}, scores, 10.0) < probability_of({"lag", "filter"}, scores, 1.0)


def test_a_set_without_an_effect_counts_against_it_even_with_values_that_are_no_case_of_their_effects() -> None:
    """Something else is there, that neither is: the effect is not needed for it."""
    scores = [Score(frozenset({"lag", "brake"}), 0.0), Score(frozenset({"brake"}), -20.0, is_plausible=False)]
    assert probability_of({"lag"}, scores, 1.0) < 1e-4
    assert probability_of({"brake"}, scores, 1.0) == 1.0


def left_over(value: float, most: float, is_share: bool = True) -> checks.Test:
    return checks.Test("", value, most, is_share)


def test_differences_of_scores_count_by_what_is_left_beyond_what_explained_worlds_leave() -> None:
    """Tests find the same information again: the one that finds most of it counts, the others do not add to it."""
    assert tempered_by([left_over(0.02, 0.03), left_over(50.0, 25.0, is_share=False)], 1000, 4.0) == 4.0
    assert tempered_by([left_over(0.05, 0.03), left_over(0.13, 0.03)], 1000, 4.0) == pytest.approx(104.0)
    assert tempered_by([left_over(0.0301, 0.03)], 1000, 4.0) == pytest.approx(4.1)


@pytest.mark.parametrize(
    ("of_spread", "is_named", "is_more_than_noise", "falls", "expected"),
    [
        (0.1, True, False, True, Verdict.EXPLAINED),
        (0.1, True, True, True, Verdict.PARTLY_EXPLAINED),
        (0.1, True, False, False, Verdict.UNEXPLAINED),
        (0.1, True, True, False, Verdict.UNEXPLAINED),
        (0.1, False, False, True, Verdict.NO_MISMATCH),
        (0.1, False, True, True, Verdict.UNEXPLAINED),
        (1.2, True, True, True, Verdict.UNEXPLAINED),
        (1.2, False, False, True, Verdict.UNEXPLAINED),
    ],
)
def test_nothing_is_explained_that_leaves_as_much_as_the_signal_itself_or_an_error_that_does_not_fall(
    of_spread: float, is_named: bool, is_more_than_noise: bool, falls: bool, expected: Verdict
) -> None:
    assert verdict_of(of_spread, is_named, is_more_than_noise, falls) is expected
