"""The known driveline: its response, poles and zeros against closed forms and an independent discretisation."""

import numpy as np
import pytest

from hil.figures.local_model import TwoMassLine
from tests.estimator.identification.driveline import B_L, B_M, J_L, J_M, C, K, true_resonance
from tests.estimator.identification.driveline import LINE as TRUTH

LINE = TwoMassLine.of({"J_M": J_M, "J_L": J_L, "k": K, "c": C, "b_M": B_M, "b_L": B_L})


def test_it_is_discretised_exactly() -> None:
    for mine, other in zip(LINE.discrete(0.01), TRUTH.discrete(0.01), strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-12, atol=1e-15)


def test_its_resonance_is_that_of_the_eigenvalues() -> None:
    mode = LINE.resonance
    assert mode is not None
    assert (mode.frequency_hz, mode.damping) == pytest.approx(true_resonance())


def test_a_torque_held_for_no_time_at_all_has_the_continuous_response() -> None:
    f = np.array([0.5, 1.03, 5.0, 8.2, 20.0])
    s = 2j * np.pi * f
    # eliminate w_L from the two equations of motion: w_M / T of the two-mass drive
    shaft = K / s + C
    load = J_L * s + B_L
    expected = 1.0 / (J_M * s + B_M + shaft * load / (shaft + load))
    np.testing.assert_allclose(LINE.response(f, 1e-6), expected, rtol=1e-4)


def test_the_response_vanishes_at_the_zeros_and_a_held_torque_comes_half_its_time_late() -> None:
    anti_hz = np.sqrt(K / J_L) / (2 * np.pi)
    around = np.abs(LINE.response(np.array([0.9 * anti_hz, anti_hz, 1.1 * anti_hz]), 0.01))
    assert around[1] < 0.5 * min(around[0], around[2])
    angle = np.angle(LINE.zeros(0.01)).max()
    assert angle == pytest.approx(2 * np.pi * anti_hz * 0.01, rel=0.01)
    f = np.array([4.0])
    lag = np.angle(LINE.response(f, 0.01) / LINE.response(f, 1e-6))[0]
    assert lag == pytest.approx(-np.pi * 4.0 * 0.01, rel=0.02)  # less what folds down from above 50 Hz
