"""Ellipses and intervals against what scatters: theta drawn from its covariance, roots computed anew."""

import math

import numpy as np
import pytest

from estimator.errors import BadShape
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import (
    Uncertain,
    UncertainRoot,
    pole_zero_map,
    propagate,
    resonance,
    uncertain_modes,
)
from estimator.signals.record import FloatArray


def test_a_linear_function_has_its_exact_covariance() -> None:
    rng = np.random.default_rng(0)
    G, S = rng.normal(size=(2, 4)), rng.normal(size=(4, 4))
    value, covariance = propagate(lambda x: G @ x, np.arange(4.0), S @ S.T)
    np.testing.assert_allclose(value, G @ np.arange(4.0))
    np.testing.assert_allclose(covariance, G @ S @ S.T @ G.T, rtol=1e-9)


def test_an_interval_of_two_standard_deviations_or_so() -> None:
    one = Uncertain(10.0, 2.0)
    assert one.ci95 == pytest.approx((10 - 3.91993, 10 + 3.91993), abs=1e-4)
    assert one.covers(6.1)
    assert not one.covers(6.0)
    assert one.is_determined
    assert not Uncertain(3.0, 2.0).is_determined
    assert not Uncertain(3.0, math.inf).is_determined


T_S = 0.02
PAIR = np.exp(T_S * 2 * np.pi * 8.2 * (-0.057 + 1j * np.sqrt(1 - 0.057**2)))


def model_of(poles: list[complex], zeros: list[complex]) -> LinearModel:
    a, b = np.real(np.poly(poles))[1:], 0.01 * np.atleast_1d(np.real(np.poly(zeros)))
    return LinearModel(tuple(a.tolist()), tuple(b.tolist()), 1, T_S)


MODEL = model_of([PAIR, PAIR.conj(), 0.98], [0.9 + 0.1j, 0.9 - 0.1j])


def covariance(seed: int = 0, size: float = 1e-3) -> FloatArray:
    S = size * np.random.default_rng(seed).normal(size=(6, 6)) * np.abs(MODEL.theta)[:, np.newaxis]
    return S @ S.T


def drawn(P: FloatArray, count: int = 4000) -> list[LinearModel]:
    thetas = np.random.default_rng(1).multivariate_normal(MODEL.theta, P, size=count, method="cholesky")
    return [LinearModel.from_theta(theta, MODEL.orders, T_S) for theta in thetas]


def test_ellipses_hold_95_percent_of_the_roots() -> None:
    P = covariance()
    roots = pole_zero_map(MODEL, P)
    oscillating = next(root for root in roots.poles if root.value.imag > 0)
    inverse = np.linalg.inv(oscillating.covariance)
    inside = 0
    for model in drawn(P):
        apart = model.poles[np.argmin(np.abs(model.poles - oscillating.value))] - oscillating.value
        d = np.array([apart.real, apart.imag])
        inside += d @ inverse @ d < 5.9915  # chi-square, two degrees of freedom
    assert inside / 4000 == pytest.approx(0.95, abs=0.015)


def test_the_outline_is_the_95_percent_contour_and_closed() -> None:
    root = UncertainRoot(0.5 + 0.5j, np.array([[4e-4, 1e-4], [1e-4, 1e-4]]))
    outline = root.ellipse()
    d = np.array([(outline - root.value).real, (outline - root.value).imag])
    np.testing.assert_allclose(np.sum(d * (np.linalg.inv(root.covariance) @ d), axis=0), 5.9915, rtol=1e-4)
    assert outline[0] == pytest.approx(outline[-1])


def test_a_real_root_has_a_segment() -> None:
    outline = UncertainRoot(0.9 + 0j, np.diag([1e-4, 0.0])).ellipse()
    assert not outline.imag.any()
    assert outline.real.max() == pytest.approx(0.9 + 1.96e-2, abs=1e-5)


def test_intervals_are_as_wide_as_frequency_and_damping_scatter() -> None:
    P = covariance()
    (found,) = uncertain_modes(MODEL, P)
    assert found.mode.frequency_hz == pytest.approx(8.2)
    scattered = [mode for mode in map(resonance, drawn(P)) if mode is not None]
    assert len(scattered) == 4000
    assert found.frequency_hz.std == pytest.approx(np.std([mode.frequency_hz for mode in scattered]), rel=0.04)
    assert found.damping.std == pytest.approx(np.std([mode.damping for mode in scattered]), rel=0.04)


def test_a_double_root_is_of_unknown_place() -> None:
    double = model_of([0.5, 0.5], [])
    assert all(np.isinf(root.covariance[0, 0]) for root in pole_zero_map(double, 1e-6 * np.eye(3)).poles)


def near_cancelling(apart: float) -> LinearModel:
    pair = 0.6 * np.exp(1.9j)
    return model_of([PAIR, PAIR.conj(), pair, pair.conj()], [pair + apart, (pair + apart).conj(), 0.9])


def test_a_pair_closer_to_its_zeros_than_they_are_certain_is_flagged() -> None:
    P = 1e-10 * np.eye(8)
    flagged = pole_zero_map(near_cancelling(1e-7), P).cancellations
    assert len(flagged) == 1
    assert flagged[0].pole == pytest.approx(0.6 * np.exp(1.9j))
    assert "can't be distinguished" in flagged[0].statement
    assert pole_zero_map(near_cancelling(0.05), P).cancellations == ()


def test_pole_and_zero_that_move_together_do_not_cancel_for_their_large_ellipses() -> None:
    """Both are uncertain by 0.1, their difference of 0.02 by nothing: they are two."""
    model = model_of([0.5], [0.48])
    along = np.array([-1.0, 0.0, -model.b[0]])  # d pole = d zero
    P = 0.01 * np.outer(along, along) + 1e-12 * np.eye(3)
    roots = pole_zero_map(model, P)
    assert np.sqrt(roots.poles[0].covariance[0, 0]) == pytest.approx(0.1, rel=1e-3)
    assert roots.cancellations == ()


def test_false_flags_are_as_rare_as_the_confidence_says_where_they_cancel() -> None:
    """True cancellation, estimates that scatter: 95 % of them are recognised as such."""
    true = model_of([0.5, 0.9], [0.5])
    P = np.diag([1e-6, 1e-6, 1e-10, 1e-10])
    thetas = np.random.default_rng(2).multivariate_normal(true.theta, P, size=1000)
    flagged = sum(
        any(abs(pair.pole - 0.5) < 0.1 for pair in pole_zero_map(model, P).cancellations)
        for model in (LinearModel.from_theta(theta, true.orders, T_S) for theta in thetas)
    )
    assert flagged / 1000 == pytest.approx(0.95, abs=0.02)


@pytest.mark.parametrize("function", [pole_zero_map, uncertain_modes])
def test_a_covariance_of_another_model_is_refused(function) -> None:  # type: ignore[no-untyped-def]  # one of two
    with pytest.raises(BadShape, match=r"shape \(4, 4\), expected \(6, 6\)"):
        function(MODEL, np.eye(4))
