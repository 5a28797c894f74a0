"""What may hang on the motor shaft: a generator behind its clutch, a shorted turn."""

import numpy as np
import pytest

from hil.proof.truth import laws
from hil.proof.truth.physics import StateIndex


@pytest.fixture
def alone(plain):
    """A motor without a shaft, and a generator of half its inertia whose clutch closes from 1 to 2 s."""
    return plain._replace(
        k=0.0,
        c=0.0,
        b_M=0.0,
        generator_inertia=0.8,
        generator_lag=0.1,
        clutch_nm=400.0,
        clutch_rise_s=0.2,
        clutch_from_s=1.0,
        clutch_to_s=2.0,
    )


def test_a_closed_clutch_adds_its_inertia_and_an_open_one_none(alone, trace):
    states = trace(alone, [40.0] * 300, speed_rad_s=20.0)
    acceleration = np.diff(states[:, StateIndex.SPEED_M]) / 0.01
    np.testing.assert_allclose(acceleration[:100], 40.0 / 1.6, rtol=1e-6)
    np.testing.assert_allclose(acceleration[140:200], 40.0 / 2.4, rtol=1e-6)
    np.testing.assert_allclose(acceleration[210:], 40.0 / 1.6, rtol=1e-6)


def test_a_closing_clutch_conserves_the_momentum_and_ends_in_one_speed(alone, trace):
    states = trace(alone, [0.0] * 180, speed_rad_s=50.0)
    motor, generator = states[:, StateIndex.SPEED_M], states[:, StateIndex.SPEED_G]
    assert generator[99] == pytest.approx(45.0)
    momentum = 1.6 * motor[100:] + 0.8 * generator[100:]
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-9)
    slipping = np.flatnonzero(np.abs(motor - generator)[100:] > 1e-6)
    assert 3 <= slipping.size <= 20  # some hundredths of a second, and within the clutch's rise
    assert motor[-1] == pytest.approx(generator[-1], abs=1e-9)


def test_a_clutch_that_is_too_weak_continues_slipping(alone, trace):
    states = trace(alone._replace(clutch_nm=20.0), [300.0] * 190)
    slip = states[:, StateIndex.SPEED_M] - states[:, StateIndex.SPEED_G]
    assert np.all(np.diff(slip[121:]) > 0.0)
    np.testing.assert_allclose(np.diff(states[121:, StateIndex.SPEED_G]) / 0.01, 20.0 / 0.8, rtol=1e-6)


def test_eddy_drag_is_greatest_at_its_speed_and_odd(plain):
    p = plain._replace(eddy_nm=30.0, eddy_speed_rad_s=15.0)
    speeds = np.linspace(0.0, 100.0, 2001)
    torques = np.array([laws.eddy_torque(p, speed) for speed in speeds])
    assert speeds[np.argmax(torques)] == pytest.approx(15.0)
    assert torques.max() == pytest.approx(30.0)
    assert laws.eddy_torque(p, -40.0) == -laws.eddy_torque(p, 40.0)


def test_gears_lose_a_share_of_the_power_whoever_drives(plain):
    p = plain._replace(efficiency=0.95, efficiency_back=0.9)
    assert laws.behind_gears(p, 100.0, 10.0) == pytest.approx(95.0)
    assert laws.behind_gears(p, -100.0, -10.0) == pytest.approx(-95.0)
    assert laws.behind_gears(p, -90.0, 10.0) == pytest.approx(-100.0)
    assert laws.behind_gears(p, 100.0, 0.0) == 100.0
