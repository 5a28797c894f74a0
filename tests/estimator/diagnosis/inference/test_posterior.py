"""Shares add up to what is explained; a probability sums over all sets that hold an effect."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import pytest

from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.diagnosis.inference.posterior import probability_of, shares


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
    told_another_way = shares(path(("", 100.0), ("lag", 60.0), ("lag brake", 40.0), ("lag brake", 10.0)))
    assert told_another_way == pytest.approx({"lag": 0.6, "brake": 0.3})
    dropped = shares(path(("", 100.0), ("lag", 60.0), ("lag brake", 40.0), ("brake", 41.0)))
    assert dropped == pytest.approx({"brake": 0.59})


def test_without_effects_nothing_is_shared_out() -> None:
    assert shares(path(("", 100.0))) == {}


def test_a_probability_sums_over_all_sets_that_hold_the_effect_or_a_look_alike() -> None:
    scores = [([], 6.0), (["lag"], 0.0), (["filter"], 0.0), (["brake", "lag"], 0.0)]
    one = probability_of({"lag"}, scores, 1.0)
    assert one == pytest.approx(2.0 / (3.0 + 0.0498), rel=1e-3)
    assert probability_of({"lag", "filter"}, scores, 1.0) > one
    assert probability_of({"lag", "filter"}, scores, 10.0) < probability_of({"lag", "filter"}, scores, 1.0)
