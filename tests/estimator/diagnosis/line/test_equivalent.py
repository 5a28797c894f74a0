"""The unknown input at each place: found where it was planted, with a band that covers it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from estimator.diagnosis.line.equivalent import Filtered, explain, run_filter, run_smoother
from estimator.diagnosis.line.whitening import StateSpace, terms_of
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.planted import SIGMA, Moved, recordings
from tests.estimator.physics.bench import TWO_MASS, model


def test_filter_and_smoother_are_the_conditional_normal_distribution() -> None:
    """Against the joint normal distribution of 30 samples, inverted as a whole."""
    rng = np.random.default_rng(2)
    samples, n = 30, 2
    phi = np.array([[0.9, 0.2], [-0.3, 0.8]])
    drive, c, direct = np.array([0.5, 0.1]), np.array([1.0, 0.3]), 0.2
    memory, walk, noise = 0.97, 0.3, 0.1
    okay = np.arange(samples) % 7 != 3
    f = np.block([[phi, drive[:, None]], [np.zeros((1, n)), np.array([[memory]])]])
    prior = np.diag([1.0, 2.0, 3.0])
    move = np.eye(3 * samples)
    for b in range(1, samples):
        move[3 * b : 3 * b + 3] = f @ move[3 * b - 3 : 3 * b]
        move[3 * b : 3 * b + 3, 3 * b : 3 * b + 3] = np.eye(3)
    covariance = move @ block_diag(prior, *[np.diag([0.0, 0.0, walk])] * (samples - 1)) @ move.T
    seen = np.flatnonzero(okay)
    h = np.zeros((seen.size, 3 * samples))
    for row, b in enumerate(seen):
        h[row, 3 * b : 3 * b + 3] = [*c, direct]
    spread = h @ covariance @ h.T + noise * np.eye(seen.size)
    error = rng.standard_normal(samples)
    gain = covariance @ h.T @ np.linalg.inv(spread)
    mean = (gain @ error[seen]).reshape(samples, 3)
    variance = np.diag(covariance - gain @ h @ covariance).reshape(samples, 3)
    likelihood = -0.5 * (
        error[seen] @ np.linalg.solve(spread, error[seen])
        + np.linalg.slogdet(spread)[1]
        + seen.size * np.log(2.0 * np.pi)
    )

    shown, drives = np.array([*c, direct]), np.diag([0.0, 0.0, walk])
    model = StateSpace(
        terms_of(f), terms_of(shown[None]), drives.ravel(), np.array([noise]), prior.ravel(), np.eye(0, 3), np.zeros(0)
    )
    kept = Filtered(*np.zeros((3, samples, 3)), *np.zeros((2, samples)))
    value, spreads = np.zeros((2, samples))
    run_filter(model, error, okay, model.prior.copy(), kept)
    squares = kept.innovations[okay] ** 2 * kept.precisions[okay]
    assert -0.5 * np.sum(np.log(2.0 * np.pi / kept.precisions[okay]) + squares) == pytest.approx(likelihood)
    run_smoother(f, shown, kept, value, spreads)
    np.testing.assert_allclose(value, mean[:, 2], atol=1e-9)
    np.testing.assert_allclose(spreads, variance[:, 2], atol=1e-9)


def stairs(moved: Moved) -> FloatArray:
    """Random steps every 0.3 s, the same in every recording, about zero."""
    rng = np.random.default_rng(11)
    levels = rng.uniform(-1.0, 1.0, 60)
    return (levels - levels.mean())[(moved.time_s / 0.3).astype(int)]


def nominal(element: Element, size: float) -> FitResult:
    """The true line, nothing re-tuned, on recordings with a planted input."""
    return fit(make_problem(model(TWO_MASS), recordings(element, stairs, size), ()))


PLANTED = [
    (Element.TORQUE_PATH, Element.MOTOR, 20.0),
    (Element.SHAFT, Element.SHAFT, 40.0),
    (Element.LOAD, Element.LOAD, 20.0),
    (Element.SPEED_SENSOR, Element.SPEED_SENSOR, 0.3),
]


@pytest.mark.parametrize(("element", "place", "size"), PLANTED, ids=[p.value for _, p, _ in PLANTED])
def test_a_planted_input_is_found_within_its_band(element: Element, place: Element, size: float) -> None:
    """But for its mean: a constant torque is the constant load's, a constant twist is invisible."""
    result = nominal(element, size)
    (first, _) = explain(result, place, SIGMA).inputs
    time_s = result.problem.records[0].time_s
    planted = size * stairs(Moved(time_s, *[np.zeros_like(time_s)] * 5))
    apart = first.value - planted
    apart -= np.median(apart)
    assert np.mean(np.abs(apart) <= 1.96 * first.std) > 0.9
    assert np.std(apart) < (0.6 if place is Element.SHAFT else 0.4) * np.std(
        planted
    )  # the shaft's slow part is invisible
