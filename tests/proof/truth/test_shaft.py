"""What a shaft may be beyond a spring: cracked, stiffened by speed, hysteretic, bent at a joint, or two shafts."""

import numpy as np
import pytest

from hil.proof.truth import laws
from hil.proof.truth.physics import StateIndex


def _ringing_rad_s(states, period_s):
    """Angular frequency at which motor and load swing against each other."""
    speed = states[:, StateIndex.SPEED_M] - states[:, StateIndex.SPEED_L]
    up = np.flatnonzero((speed[:-1] < 0) & (speed[1:] >= 0))
    crossing = (up - speed[up] / (speed[up + 1] - speed[up])) * period_s
    return 2 * np.pi * (up.size - 1) / (crossing[-1] - crossing[0])


def test_a_crack_changes_the_frequency_from_its_moment_on(lossless, trace):
    p = lossless._replace(stiffness_step=-0.3, stiffness_step_at_s=2.0, stiffness_step_rise_s=0.05)
    states = trace(p, [400.0] * 5 + [0.0] * 3995, period_s=0.001)
    free = np.sqrt(p.k * (1 / p.J_M + 1 / p.J_L))
    assert _ringing_rad_s(states[5:2000], 0.001) == pytest.approx(free, rel=1e-4)
    assert _ringing_rad_s(states[2051:], 0.001) == pytest.approx(free * np.sqrt(0.7), rel=1e-4)


def test_a_shaft_stiffened_by_speed_rings_higher_when_it_turns(lossless, trace):
    p = lossless._replace(stiffness_speed_share=0.4, stiffness_speed_rad_s=30.0)
    free = np.sqrt(p.k * (1 / p.J_M + 1 / p.J_L))
    for speed, factor in ((0.0, 1.0), (30.0, 1.2), (3000.0, 1.4)):
        states = trace(p, [40.0] * 5 + [0.0] * 2000, period_s=0.001, speed_rad_s=speed)
        assert _ringing_rad_s(states[5:], 0.001) == pytest.approx(free * np.sqrt(factor), rel=2e-3)


@pytest.fixture
def sliding(plain):
    return plain._replace(hysteresis_stiffness=1600.0, hysteresis_slip_rad=0.04)


def _along(p, twists):
    deflections, torques = np.zeros(laws.ELEMENTS), []
    for change in np.diff(twists, prepend=0.0):
        laws.follow_twist(deflections, p, change)
        torques.append(laws.slider_torque(deflections, p))
    return np.array(torques)


def test_sliders_are_stiff_for_small_twists_and_give_way_to_large_ones(sliding):
    torque = _along(sliding, np.array([0.004, 0.02, 0.04, 0.08]))
    assert torque[0] == pytest.approx(1600.0 * 0.004)
    assert torque[1] < 0.9 * 1600.0 * 0.02
    limits = 0.04 * np.arange(1, laws.ELEMENTS + 1) / laws.ELEMENTS
    assert torque[2] == pytest.approx(torque[3]) == pytest.approx(1600.0 * limits.mean())


def test_a_cycle_of_large_twist_loses_four_times_limit_by_what_slides(sliding):
    """Each element slides by 2 (A - limit) in each direction under stiffness times limit."""
    A = 0.06
    there_and_back = np.concatenate([np.linspace(A, -A, 4001), np.linspace(-A, A, 4001)[1:]])
    torque = _along(sliding, np.concatenate([[A], there_and_back]))[1:]
    lost = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(there_and_back))
    limits = 0.04 * np.arange(1, laws.ELEMENTS + 1) / laws.ELEMENTS
    assert lost == pytest.approx(np.sum(1600.0 / laws.ELEMENTS * limits * 4 * (A - limits)), rel=1e-3)


def test_hysteresis_damps_a_large_swing_and_leaves_a_small_one(lossless, trace, twist):
    p = lossless._replace(k=3000.0, hysteresis_stiffness=1200.0, hysteresis_slip_rad=0.04)
    peaks = []
    for torque in (1.0, 400.0):
        swing = np.abs(twist(trace(p, [torque] * 50 + [0.0] * 1500, period_s=0.001)))[50:]
        peaks.append(swing[-300:].max() / swing[:300].max())
    assert peaks[0] == pytest.approx(1.0, abs=0.01)
    assert peaks[1] < 0.6
