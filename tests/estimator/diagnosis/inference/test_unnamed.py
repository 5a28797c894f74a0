"""A law without a name pays as an effect does, and stands against the names that act elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimator.diagnosis.inference.judge import Grounds, decide, grounds

from estimator.diagnosis.inference.hypotheses import everything, open_hypotheses
from estimator.diagnosis.inference.rivals import Law, best_law, rival_laws, searches_around
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.unnamed.scene import scene
from estimator.physics.effect import Element
from estimator.signals.record import Record
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA, TIGHT, quiet, recordings
from tests.estimator.physics.bench import TWO_MASS, model


def searched(records: list[Record]) -> Search:
    line = model(TWO_MASS, TIGHT)
    return Search(line, records, everything(records), open_hypotheses(line, records)[0])


def test_a_planted_law_is_scored_by_the_likelihood_it_gains() -> None:
    """Simulated with the law the recordings are as probable as noise alone, at the price of its unknowns and choice."""
    planted = searched(recordings(Element.MOTOR, lambda m: m.speed * np.abs(m.speed), 0.1)).nothing()
    found = best_law(planted, searches_around(planted))
    assert found is not None
    assert found.element is Element.MOTOR
    assert found.terms[0] == ("w_M |w_M|", pytest.approx(0.1, rel=0.1))
    assert found.rms == pytest.approx(SIGMA, rel=0.1)
    noise = searched(quiet()).nothing()
    least = math.log(planted.result.residual.size)
    assert noise.score + least < found.score < planted.score


def test_laws_are_weighed_by_the_innovations() -> None:
    """What a filter makes of a signal is what it makes of the signal's samples in use."""
    nothing = searched(quiet()).nothing()
    view = scene(nothing.result, SIGMA, nothing.filter)
    errors = np.concatenate(view.errors)
    assert errors == pytest.approx(-nothing.filter(nothing.result.residual))
    assert float(np.mean(errors**2)) == pytest.approx(1.0, abs=0.1)


@pytest.fixture(scope="module")
def friction() -> tuple[Search, Grounds]:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    names = ["coulomb_friction_motor", "coulomb_friction_load"]
    search = Search(bench.model, bench.records, bench.use, names)
    return search, grounds(search)


def law(ground: Grounds, better: float) -> Law:
    """A law that is so much more probable than the best set of names."""
    return Law(Element.SHAFT, (("T", 1.0),), ground.best.score - better, 0.1)


def named(friction: tuple[Search, Grounds], alone: Law | None, added: Law | None) -> list[str]:
    search, ground = friction
    decision = decide(search, ground, rival_laws(ground, alone, added))
    assert {each.name for each in (*decision.named, *decision.doubted)} == {"coulomb_friction_motor"}
    return [each.name for each in decision.named]


def test_a_name_falls_to_a_law_without_one_that_is_more_probable(friction: tuple[Search, Grounds]) -> None:
    assert named(friction, law(friction[1], 100.0), None) == []


def test_a_name_stands_where_a_law_added_to_it_is_more_probable_still(friction: tuple[Search, Grounds]) -> None:
    """A law of many terms follows the form of what is there; with the name it needs fewer of them."""
    ground = friction[1]
    assert named(friction, None, None) == ["coulomb_friction_motor"]
    assert named(friction, law(ground, -100.0), None) == ["coulomb_friction_motor"]
    assert named(friction, law(ground, 100.0), law(ground, 150.0)) == ["coulomb_friction_motor"]
    assert named(friction, law(ground, 150.0), law(ground, 100.0)) == []
