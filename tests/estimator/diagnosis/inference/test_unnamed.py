"""A law without a name pays as an effect does, and stands against the names that act elsewhere."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.hypotheses import everything, open_hypotheses
from estimator.diagnosis.inference import remainder
from estimator.diagnosis.inference.calibration import MOST_OF_IT
from estimator.diagnosis.inference.posterior import free_rms
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.inference.unnamed import Law, best_law, hunts_around, weighed_against
from estimator.diagnosis.inference.verdict import Decision, decide, grounds
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.unnamed import scene
from estimator.physics.effect import Element
from estimator.signals.record import Record
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA, TIGHT, quiet, recordings
from tests.estimator.physics.bench import TWO_MASS, model


def searched(records: list[Record]) -> Search:
    line = model(TWO_MASS, TIGHT)
    return Search(line, records, everything(records), open_hypotheses(line, records)[0])


def test_in_noise_no_law_pays_for_itself() -> None:
    nothing = searched(quiet()).nothing()
    assert best_law(nothing, hunts_around(nothing)) is None


def test_a_planted_law_is_scored_by_the_likelihood_it_gains() -> None:
    """Simulated with the law the recordings are as probable as noise alone, at the price of its unknowns and choice."""
    planted = searched(recordings(Element.MOTOR, lambda m: m.speed * np.abs(m.speed), 0.1)).nothing()
    found = best_law(planted, hunts_around(planted))
    assert found is not None
    assert found.element is Element.MOTOR
    assert found.terms[0] == ("w_M |w_M|", pytest.approx(0.1, rel=0.1))
    assert found.rms == pytest.approx(SIGMA, rel=0.1)
    noise = searched(quiet()).nothing()
    least = math.log(planted.plain.residual.size)
    assert noise.score + least < found.score < planted.score


def test_laws_are_weighed_by_the_innovations() -> None:
    """What a filter makes of a signal is what it makes of the signal's samples in use."""
    nothing = searched(quiet()).nothing()
    view = scene(nothing.plain, SIGMA, nothing.filter)
    errors = np.concatenate(view.errors)
    assert errors == pytest.approx(-nothing.filter(nothing.plain.residual))
    assert float(np.mean(errors**2)) == pytest.approx(1.0, abs=0.1)


@pytest.fixture(scope="module")
def friction() -> Decision:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    names = ["coulomb_friction_motor", "coulomb_friction_load"]
    search = Search(bench.model, bench.records, bench.use, names)
    return decide(search, grounds(search))


def weighed(decision: Decision, rival: Law | None) -> Decision:
    return weighed_against(decision, rival, lambda _element: decision.best)


def law(decision: Decision, element: Element, better: float) -> Law:
    return Law(element, (("T", 1.0),), decision.best.score - better, 0.1)


def test_a_name_falls_to_a_law_elsewhere_that_is_more_probable(friction: Decision) -> None:
    after = weighed(friction, law(friction, Element.SHAFT, 100.0))
    assert after.named == ()
    assert after.verdict is Verdict.UNEXPLAINED
    assert [each.name for each in after.doubted] == ["coulomb_friction_motor"]
    assert after.doubted[0].probability < 0.01


def test_a_name_stands_against_a_law_that_is_less_probable_and_against_one_at_its_own_place(friction: Decision) -> None:
    assert weighed(friction, None) is friction
    for rival in (law(friction, Element.SHAFT, -100.0), law(friction, Element.MOTOR, 100.0)):
        after = weighed(friction, rival)
        assert after.verdict is Verdict.EXPLAINED
        assert [each.name for each in after.named] == ["coulomb_friction_motor"]


def test_a_name_that_gains_too_little_of_what_a_law_at_its_place_gains_is_another_law(friction: Decision) -> None:
    gained = friction.nothing.score - friction.best.score
    as_much = gained / MOST_OF_IT - gained
    after = weighed(friction, law(friction, Element.MOTOR, 1.1 * as_much))
    assert after.verdict is Verdict.UNEXPLAINED
    assert weighed(friction, law(friction, Element.MOTOR, 0.9 * as_much)).named == friction.named


def test_as_probable_as_the_name_it_takes_half_of_the_probability(friction: Decision) -> None:
    (after,) = weighed(friction, law(friction, Element.SHAFT, 0.0)).doubted
    (before,) = friction.named
    assert after == replace(before, probability=pytest.approx(0.5 * before.probability))


def test_what_is_no_better_than_the_nominal_model_takes_nothing(friction: Decision) -> None:
    """However little differences of scores count where much is left: the posterior has counted that already."""
    doubtful = replace(friction, failed=(remainder.Test("foretold by its own past", 0.5, 0.03, is_share=True),))
    for better in (0.0, -5.0):
        rival = Law(Element.SHAFT, (("T", 1.0),), friction.nothing.score - better, 0.1)
        (after,) = weighed(doubtful, rival).named
        assert after.probability == pytest.approx(friction.named[0].probability)


def test_a_law_that_leaves_the_error_as_it_is_takes_nothing(friction: Decision) -> None:
    """It makes the innovations smaller; the name explains what goes wrong over seconds."""
    trace = replace(law(friction, Element.SHAFT, 100.0), rms=free_rms(friction.nothing))
    assert weighed(friction, trace) is friction
