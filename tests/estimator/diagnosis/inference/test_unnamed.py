"""A law without a name pays as an effect does, and is sought only where something is left, or was."""

from __future__ import annotations

import math

import numpy as np
import pytest

from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import all_good_samples, open_hypotheses
from estimator.diagnosis.inference.rivals import best_law, laws_around, searches_around
from estimator.diagnosis.unnamed.scene import scene
from estimator.physics.effect import Element
from estimator.signals.record import Record
from tests.estimator.diagnosis.one_effect import bench_with, decided, searched as searched_on
from tests.estimator.diagnosis.planted import SIGMA, TIGHT, quiet, recordings
from tests.estimator.physics.bench import TWO_MASS, model


def searched(records: list[Record]) -> Fits:
    line = model(TWO_MASS, TIGHT)
    return Fits(line, records, all_good_samples(records), open_hypotheses(line, records)[0])


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


def test_a_law_is_sought_where_something_is_left_or_was() -> None:
    """Next to the re-tuned model and, with a name, for what that leaves: nothing here."""
    names = ["coulomb_friction_motor", "quadratic_friction"]
    explained = decided(searched_on(bench_with(names[0], {"friction_nm": 8.0}), names)).judged
    laws = laws_around(explained)
    assert laws.alone is not None
    assert laws.left is None
    plain = decided(searched_on(bench_with(names[1], {"quadratic_nm_s2": 1e-9}), names)).judged
    assert laws_around(plain).alone is None


def test_where_nothing_is_named_the_law_for_what_is_left_is_the_one_alone() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    judged = decided(searched_on(bench, ["torque_bias"])).judged
    assert not judged.named
    laws = laws_around(judged)
    assert laws.alone is not None
    assert laws.left is laws.alone
