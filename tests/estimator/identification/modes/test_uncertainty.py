"""Ellipses and intervals against what scatters: theta drawn from its covariance, roots computed anew."""

import numpy as np
import pytest

from estimator.errors import BadShape
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import pole_zero_map, propagate, resonance, uncertain_modes
from estimator.signals.record import FloatArray


def test_a_linear_function_has_its_exact_covariance() -> None:
    rng = np.random.default_rng(0)
    G, S = rng.normal(size=(2, 4)), rng.normal(size=(4, 4))
    value, covariance = propagate(lambda x: G @ x, np.arange(4.0), S @ S.T)
    np.testing.assert_allclose(value, G @ np.arange(4.0))
    np.testing.assert_allclose(covariance, G @ S @ S.T @ G.T, rtol=1e-9)


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


def test_intervals_are_as_wide_as_frequency_and_damping_scatter() -> None:
    P = covariance()
    (found,) = uncertain_modes(MODEL, P)
    assert found.mode.frequency_hz == pytest.approx(8.2)
    scattered = [mode for mode in map(resonance, drawn(P)) if mode is not None]
    assert len(scattered) == 4000
    assert found.frequency_hz.std == pytest.approx(np.std([mode.frequency_hz for mode in scattered]), rel=0.04)
    assert found.damping.std == pytest.approx(np.std([mode.damping for mode in scattered]), rel=0.04)


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
