"""The twist filter against a driveline whose twist is known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.identification.modes.modes import two_mass_resonance
from estimator.physics.joint import Shaft, TwistFilter, Uncertainty
from tests.monitor.two_mass import PERIOD_S, driven

SHAFT = Shaft(J_M=1.6, J_L=100.0, k=4200.0, c=9.0, b_M=0.35, b_L=0.9, source="test")


def filtered(shaft: Shaft, torque_nm: np.ndarray, speed_rad_s: np.ndarray, okay: np.ndarray) -> np.ndarray:
    twist = TwistFilter(shaft, PERIOD_S)
    rows = zip(torque_nm.tolist(), speed_rad_s.tolist(), okay.tolist(), strict=True)
    return np.array([twist.step(*row) for row in rows])


def test_without_noise_the_twist_is_the_true_one() -> None:
    drive = driven(SHAFT, 1000, seed=1)
    found = filtered(SHAFT, drive.torque_nm, drive.speed_rad_s, np.ones(1000, dtype=bool))
    np.testing.assert_allclose(found, drive.twist_rad, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_stated_deviation_is_the_real_one(seed: int) -> None:
    """Mean of (error / deviation)^2 is 1; its own deviation over n samples correlated over m is sqrt(2 m / n).

    The slowest error is that of the load's walk, over some 50 samples: with n = 6000 that is 0.13, and 4 of it 0.52.
    """
    noise = Uncertainty()
    drive = driven(SHAFT, 6500, seed, noise.speed_rad_s, noise.torque_nm, noise.load_nm_per_sqrt_s)
    found = filtered(SHAFT, drive.torque_nm, drive.speed_rad_s, np.ones(6500, dtype=bool))
    error = (found - drive.twist_rad)[500:]
    share = float(np.mean(error**2)) / TwistFilter(SHAFT, PERIOD_S).twist_std_rad ** 2
    assert 0.48 < share < 1.52


def test_a_gap_is_bridged_by_the_model() -> None:
    drive = driven(SHAFT, 1000, seed=3)
    okay = np.ones(1000, dtype=bool)
    okay[500:505] = False
    torque_nm, speed = drive.torque_nm.copy(), drive.speed_rad_s.copy()
    torque_nm[~okay], speed[~okay] = math.nan, math.nan
    found = filtered(SHAFT, torque_nm, speed, okay)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[900:], drive.twist_rad[900:], atol=1e-4)


def test_k_and_c_of_a_resonance_are_those_it_is_of() -> None:
    free = replace(SHAFT, b_M=0.0, b_L=0.0)
    mode = two_mass_resonance(free.J_M, free.J_L, free.k, free.c, free.b_M, free.b_L)
    assert mode is not None
    other = replace(free, k=1.0, c=1.0).with_resonance(mode)
    assert (other.k, other.c) == (pytest.approx(free.k), pytest.approx(free.c))
    assert other.source == "resonance"
