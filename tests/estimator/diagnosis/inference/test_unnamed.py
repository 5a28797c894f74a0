"""A law without a name pays as an effect does, and stands against the names that act elsewhere."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.hypotheses import everything, open_hypotheses
from estimator.diagnosis.inference import remainder
from estimator.diagnosis.inference.calibration import MOST_AT_PLACE, MOST_ELSEWHERE
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


def more(decision: Decision, most: float) -> float:
    """By how much a law gains more than the names where they gain a share ``most`` of it."""
    return (1.0 / most - 1.0) * (decision.nothing.score - decision.best.score)


def test_a_name_falls_to_a_law_elsewhere_that_gains_more(friction: Decision) -> None:
    after = weighed(friction, law(friction, Element.SHAFT, 1.1 * more(friction, MOST_ELSEWHERE)))
    assert after.named == ()
    assert after.verdict is Verdict.UNEXPLAINED
    assert [each.name for each in after.doubted] == ["coulomb_friction_motor"]
    assert after.doubted[0].probability < 0.01


@pytest.mark.parametrize("better", [-100.0, 0.0, 100.0])
def test_a_name_stands_against_a_law_that_gains_hardly_more(friction: Decision, better: float) -> None:
    """A law of many terms follows the form of what is there more closely."""
    assert better < more(friction, MOST_ELSEWHERE)
    assert weighed(friction, None) is friction
    assert weighed(friction, law(friction, Element.SHAFT, better)) is friction


def test_a_name_stands_against_a_law_at_its_own_place_that_gains_somewhat_more(friction: Decision) -> None:
    for times, stands in ((0.9, True), (1.1, False)):
        after = weighed(friction, law(friction, Element.MOTOR, times * more(friction, MOST_AT_PLACE)))
        assert (after.named == friction.named) is stands
        assert (after.verdict is Verdict.UNEXPLAINED) is not stands


def test_what_is_no_better_than_the_nominal_model_takes_nothing(friction: Decision) -> None:
    """However little differences of scores count where much is left: the posterior has counted that already."""
    doubtful = replace(friction, failed=(remainder.Test("predicted by its own past", 0.5, 0.03, is_share=True),))
    for better in (0.0, -5.0):
        rival = Law(Element.SHAFT, (("T", 1.0),), friction.nothing.score - better, 0.1)
        (after,) = weighed(doubtful, rival).named
        assert after.probability == pytest.approx(friction.named[0].probability)


def test_a_law_that_leaves_the_error_as_it_is_takes_nothing(friction: Decision) -> None:
    """It makes the innovations smaller; the name explains what goes wrong over seconds."""
    trace = replace(law(friction, Element.SHAFT, 100.0), rms=free_rms(friction.nothing))
    assert weighed(friction, trace) is friction
