from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete

from estimator.errors import BadModel
from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.reduced import state_space, to_continuous
from tests.estimator.identification import driveline

T_S = 0.01


def sampled(numerator: list[float], denominator: list[float]) -> LinearModel:
    b, a, _ = cont2discrete((numerator, denominator), T_S)
    return LinearModel(tuple(a[1:].tolist()), tuple(b.ravel()[1:].tolist()), 1, T_S)


def two_mass() -> tuple[list[float], list[float]]:
    """Numerator and denominator of motor speed over motor torque, by hand."""
    J_M, J_L, k, c, b_M, b_L = (getattr(driveline, name) for name in ("J_M", "J_L", "K", "C", "B_M", "B_L"))
    denominator = [
        J_M * J_L,
        J_M * (c + b_L) + J_L * (c + b_M),
        (J_M + J_L) * k + c * (b_M + b_L) + b_M * b_L,
        k * (b_M + b_L),
    ]
    return [J_L, c + b_L, k], denominator


def test_sampling_is_undone() -> None:
    numerator, denominator = two_mass()
    back = to_continuous(sampled(numerator, denominator))
    np.testing.assert_allclose(back.numerator[1:], np.array(numerator) / denominator[0], rtol=1e-6)
    np.testing.assert_allclose(back.denominator[1:], np.array(denominator[1:]) / denominator[0], rtol=1e-6)
    np.testing.assert_allclose(np.sort_complex(back.poles), np.sort_complex(np.linalg.eigvals(driveline.A)), rtol=1e-5)


def test_the_antiresonance_is_that_of_the_load_on_its_spring() -> None:
    numerator, denominator = two_mass()
    mode = to_continuous(sampled(numerator, denominator)).antiresonance
    assert mode is not None
    assert mode.frequency_hz == pytest.approx(np.sqrt(4200 / 100) / (2 * np.pi), rel=1e-4)
    assert mode.damping == pytest.approx((9.0 + 0.9) / (2 * np.sqrt(4200 * 100)), rel=1e-4)


def test_without_oscillating_zeros_there_is_no_antiresonance() -> None:
    assert to_continuous(sampled([1.0], [1.0, 3.0, 2.0])).antiresonance is None


@pytest.mark.parametrize("nk", [0, 1, 3])
def test_the_state_space_has_the_models_response(nk: int) -> None:
    model = LinearModel((-1.2, 0.5), (0.3, 0.1), nk, T_S)
    A, B, C, D = state_space(model)
    frequency_hz = np.array([0.0, 3.0, 20.0, 49.0])
    z = np.exp(2j * np.pi * frequency_hz * T_S)
    response = [(C @ np.linalg.solve(at * np.eye(A.shape[0]) - A, B))[0, 0] + D for at in z]
    np.testing.assert_allclose(response, model.response(frequency_hz))


@pytest.mark.parametrize("a", [(0.5,), (-0.4, -0.1), (0.0,), ()])
def test_poles_no_continuous_system_has_are_refused(a: tuple[float, ...]) -> None:
    with pytest.raises(BadModel, match="no continuous system has such samples"):
        to_continuous(LinearModel(a, (1.0,), 1, T_S))
