"""Each effect measured on the simulator as one would measure it on a bench."""

import numpy as np
import pytest

from hil.proof.truth import laws
from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.physics import StateIndex


def test_stribeck_friction_breaks_away_higher_than_it_slides(plain, trace):
    p = plain._replace(friction_motor_nm=15.0, breakaway_motor_nm=40.0, stribeck_speed_rad_s=1.0)
    states = trace(p, np.concatenate([np.arange(0.0, 60.0, 0.05), np.full(1500, 60.0)]))
    held = p.friction_motor_nm * states[:, StateIndex.BRISTLE_M]
    assert held.max() == pytest.approx(40.0, rel=0.03)
    assert held[-1] == pytest.approx(15.0, rel=0.05)
    assert laws.sliding_torque(15.0, 40.0, 1.0, 10.0) == pytest.approx(15.0)
    assert laws.sliding_torque(15.0, 40.0, 1.0, 0.0) == pytest.approx(40.0)


def test_the_play_is_traversed_without_torque(plain, trace, twist):
    gap = 0.02
    p = plain._replace(gap_rad=gap, b_M=0.0, b_L=0.0)
    states = trace(p, [100.0] * 600 + [-100.0] * 100, period_s=0.001)
    across = np.abs(twist(states)) < 0.5 * gap - 1e-4
    acceleration = np.diff(states[:, StateIndex.SPEED_M]) / 0.001
    inside = across[:-1] & across[1:]
    late = np.arange(inside.size) >= 600
    np.testing.assert_allclose(acceleration[inside & late], -100.0 / p.J_M, rtol=1e-6)
    assert twist(states).max() - 100.0 / p.k > 0.5 * gap - 1e-3
    assert twist(states).min() < -0.5 * gap


def test_a_contact_presses_and_never_pulls(plain):
    p = plain._replace(gap_rad=0.02)
    for twist_rad in np.linspace(-0.05, 0.05, 41):
        for rate in np.linspace(-50.0, 50.0, 41):
            assert laws.shaft_torque(p, twist_rad, rate) * np.sign(twist_rad) >= 0.0


@pytest.mark.parametrize(
    ("field", "potential"),
    [
        ("hardening_twist_rad", lambda x: np.cosh(x) - 1.0),
        ("softening_twist_rad", lambda x: x * np.arcsinh(x) - np.sqrt(1.0 + x**2) + 1.0),
    ],
)
def test_a_nonlinear_shaft_is_conservative(lossless, trace, twist, field, potential):
    p = lossless._replace(**{field: 0.05})
    states = trace(p, [400.0] * 8 + [0.0] * 500)[8:]
    elastic = p.k * 0.05**2 * potential(twist(states) / 0.05)
    energy = elastic + 0.5 * (p.J_M * states[:, 2] ** 2 + p.J_L * states[:, 3] ** 2)
    assert np.ptp(elastic) > 0.2 * energy[0] * p.J_M / p.J_L
    np.testing.assert_allclose(energy, energy[0], rtol=2e-5)


def test_the_brake_takes_its_torque_in_its_time_alone(plain, trace):
    p = plain._replace(b_M=0.0, b_L=0.0, brake_nm=100.0, brake_from_s=2.0, brake_to_s=5.0)
    states = trace(p, [0.0] * 800, speed_rad_s=60.0)
    momentum = p.J_M * states[:, StateIndex.SPEED_M] + p.J_L * states[:, StateIndex.SPEED_L]
    np.testing.assert_allclose(momentum[:201], momentum[0], rtol=1e-9)
    np.testing.assert_allclose(momentum[501:], momentum[-1], rtol=1e-9)
    assert momentum[0] - momentum[-1] == pytest.approx(100.0 * (3.0 - laws.BRAKE_RISE_S), rel=1e-3)


def test_a_hill_gives_back_what_it_took(lossless, trace):
    road = np.array([[0.8, 2 * np.pi / 90.0, 0.3], [0.3, 2 * np.pi / 50.0, 1.0]])
    p = lossless._replace(road=road, metres_per_rad=0.0857, gravity_nm=8000.0)
    states = trace(p, [0.0] * 2000, speed_rad_s=60.0)
    x = p.metres_per_rad * states[:, StateIndex.ANGLE_L]
    height = (road[:, 0] * np.sin(np.outer(x, road[:, 1]) + road[:, 2])).sum(axis=1)
    twist = states[:, 0] - states[:, 1]
    energy = 0.5 * (p.J_M * states[:, 2] ** 2 + p.J_L * states[:, 3] ** 2 + p.k * twist**2)
    potential = p.gravity_nm / p.metres_per_rad * height
    assert np.ptp(potential) > 1e4
    # torque is m g sin(slope): what is driven along the slope, not along the map, rises by the height
    np.testing.assert_allclose(energy + potential, energy[0] + potential[0], atol=0.004 * np.ptp(potential))


def test_the_resolver_error_returns_after_a_turn_and_has_its_amplitude(plain):
    p = plain._replace(k=0.0, c=0.0, b_M=0.0, resolver_once_rad=0.01, resolver_twice_rad=0.004)
    driveline = TruthDriveline(p, 10.0)
    n = 2000
    believed = np.empty(n)
    for i in range(n):
        believed[i] = driveline.speed_rad_s
        driveline.advance((0.0, 0.0), 2 * np.pi / 10.0 / n)
    spectrum = np.fft.rfft(believed) / n
    assert spectrum[0].real == pytest.approx(10.0, rel=1e-9)
    assert 2 * abs(spectrum[1]) == pytest.approx(10.0 * 0.01, rel=1e-6)
    assert 2 * abs(spectrum[2]) == pytest.approx(10.0 * 2 * 0.004, rel=1e-6)


def test_a_maxwell_branch_is_stiff_when_fast_and_gone_when_slow(plain, trace, twist):
    p = plain._replace(maxwell_stiffness=2000.0, maxwell_time_s=0.02, b_M=0.0, b_L=0.0)
    still = trace(p, [0.0] + [p.k * 0.02 * (p.J_M + p.J_L) / p.J_L] * 1500)
    assert still[-1, StateIndex.MAXWELL_NM] == pytest.approx(0.0, abs=0.5)
    assert twist(still)[-1] == pytest.approx(0.02, rel=0.02)
    fast = p._replace(maxwell_time_s=1e3, c=0.0)
    states = trace(fast, [400.0] * 5 + [0.0] * 2000, period_s=0.001)[5:]
    speed = states[:, StateIndex.SPEED_M] - states[:, StateIndex.SPEED_L]
    up = np.flatnonzero((speed[:-1] < 0) & (speed[1:] >= 0))
    frequency = 2 * np.pi * (up.size - 1) / ((up[-1] - up[0]) * 0.001)
    assert frequency == pytest.approx(np.sqrt(6200.0 * (1 / p.J_M + 1 / p.J_L)), rel=2e-3)
