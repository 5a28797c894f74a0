"""The compiled search for the dominant mode against numpy's roots and `modes.resonance`."""

import numpy as np
import pytest

from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.modes.modes import LIGHTLY_DAMPED, resonance
from estimator.identification.tracking.poles import dominant, find_poles, mode_gradient
from estimator.signals.record import FloatArray

SAMPLE_TIME_S = 0.02
BAND = np.array([2.0, 25.0, LIGHTLY_DAMPED])


def coefficients(frequency_hz: float, damping: float, *others: complex) -> FloatArray:
    s = 2 * np.pi * frequency_hz * (-damping + 1j * np.sqrt(1 - damping**2))
    pole = np.exp(s * SAMPLE_TIME_S)
    return np.real(np.poly([pole, pole.conj(), *others]))[1:]


def search(theta: FloatArray, na: int, z: np.ndarray | None = None) -> tuple[int, FloatArray, np.ndarray]:
    z = np.zeros(na, dtype=np.complex128) if z is None else z
    mode = np.full(3, np.nan)
    return dominant(theta, na, 1, SAMPLE_TIME_S, BAND, z, mode), mode, z


@pytest.mark.parametrize("warm", [False, True])
def test_finds_the_mode_that_modes_finds(warm: bool) -> None:
    rng = np.random.default_rng(3)
    z = np.zeros(4, dtype=np.complex128)
    for _ in range(300):
        a = coefficients(rng.uniform(1, 24), rng.uniform(0.01, 0.6), *rng.uniform(-1.05, 1.05, 2))
        theta = np.concatenate([a, rng.normal(0, 1e-3, 4)])
        z = z if warm else np.zeros(4, dtype=np.complex128)
        found, mode, z = search(theta, 4, z)
        expected = resonance(LinearModel.from_theta(theta, Orders(), SAMPLE_TIME_S), (2.0, 25.0))
        if expected is None:
            assert found < 0
        else:
            assert mode.tolist() == pytest.approx([expected.frequency_hz, expected.damping, expected.height], rel=1e-7)


def test_two_real_poles_may_become_a_pair() -> None:
    _, _, z = search(np.concatenate([coefficients(8.0, 0.7, 0.5, 0.6), np.ones(4)]), 4)
    theta = np.concatenate([coefficients(8.0, 0.05, 0.55 + 0.1j, 0.55 - 0.1j), np.ones(4)])
    assert search(theta, 4, z)[0] >= 0
    assert np.sort_complex(z) == pytest.approx(np.sort_complex(np.roots([1.0, *theta[:4]])), abs=1e-12)


@pytest.mark.parametrize("a", [np.zeros(4), np.poly([0.5] * 4)[1:], np.full(4, 1e300), np.full(4, np.nan)])
def test_odd_coefficients_raise_nothing(a: FloatArray) -> None:
    z = np.zeros(4, dtype=np.complex128)
    find_poles(a, z)
    found, _, _ = search(np.concatenate([a, np.ones(4)]), 4)
    assert found < 0


def test_gradient_is_that_of_small_differences() -> None:
    a = coefficients(8.2, 0.06, 0.9, -0.7)
    theta = np.concatenate([a, [1e-3, 2e-3, -1e-3, 0.0]])
    found, _, z = search(theta, 4)
    frequency, damping = np.zeros(4), np.zeros(4)
    mode_gradient(z, found, SAMPLE_TIME_S, frequency, damping)
    for k in range(4):
        step = np.zeros(8)
        step[k] = 1e-6
        up, down = search(theta + step, 4)[1], search(theta - step, 4)[1]
        assert frequency[k] == pytest.approx((up[0] - down[0]) / 2e-6, rel=1e-5)
        assert damping[k] == pytest.approx((up[1] - down[1]) / 2e-6, rel=1e-5)
