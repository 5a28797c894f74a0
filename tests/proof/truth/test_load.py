"""What may act at the wheels: friction, slip, heavy spots, payload, cold oil."""

import numpy as np
import pytest

from hil.proof.truth import laws
from hil.proof.truth.driveline import TruthDriveline, bring_to_speed
from hil.proof.truth.physics import StateIndex


@pytest.fixture
def slipping(plain):
    return plain._replace(
        b_M=0.0, b_L=0.0, wheel_inertia=4.0, slip_stiffness_nm=2e4, grip_nm=1500.0, relaxation_rad=4.0
    )


def test_the_slip_builds_up_over_the_relaxation_length(slipping):
    """After rolling one relaxation length at a constant slip speed, 63 % of the steady slip is there."""
    at_once = laws.slip_after(0.0, slipping, 51.0, 50.0, slipping.relaxation_rad / 50.0)
    assert at_once == pytest.approx(0.02 * (1.0 - np.exp(-1.0)))
    in_steps = 0.0
    for _ in range(100):
        in_steps = laws.slip_after(in_steps, slipping, 51.0, 50.0, slipping.relaxation_rad / 5000.0)
    assert in_steps == pytest.approx(at_once)


def test_a_tyre_gives_no_more_than_its_grip(slipping):
    torques = np.array([laws.tyre_torque(slipping, slip, 60.0, 60.0) for slip in np.linspace(-1.0, 1.0, 401)])
    assert torques.max() == pytest.approx(slipping.grip_nm, rel=1e-3)
    assert torques.min() == -torques.max()
    assert abs(torques[0]) < 0.95 * slipping.grip_nm  # and less when it spins
    small = laws.tyre_torque(slipping, 1e-4, 60.0, 60.0)
    assert small == pytest.approx(1e-4 * slipping.slip_stiffness_nm, rel=1e-3)


def test_a_slipping_tyre_keeps_the_momentum(slipping, trace):
    states = trace(slipping, [300.0] * 100 + [0.0] * 200)[100:]
    inertia = [slipping.J_M, slipping.wheel_inertia, slipping.J_L - slipping.wheel_inertia]
    momentum = states[:, [StateIndex.SPEED_M, StateIndex.SPEED_L, StateIndex.SPEED_V]] @ inertia
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-9)


def test_a_heavy_spot_returns_with_each_turn_of_the_wheel(plain):
    p = plain._replace(b_M=0.0, b_L=0.0, imbalance_nm=50.0, imbalance_twice_nm=20.0, gear_ratio=5.6)
    driveline = TruthDriveline(p, 40.0)
    n, turn_s = 2000, 2 * np.pi * 5.6 / 40.0
    speed = np.empty(n)
    for i in range(n):
        speed[i] = driveline.quantity(StateIndex.SPEED_L)
        driveline.advance((0.0, 0.0), turn_s / n)
    amplitude = 2 * np.abs(np.fft.rfft(speed - np.linspace(speed[0], speed[-1], n))) / n
    per_turn = 40.0 / 5.6
    assert amplitude[1] == pytest.approx(50.0 / ((p.J_M + p.J_L) * per_turn), rel=0.05)
    assert amplitude[2] == pytest.approx(20.0 / ((p.J_M + p.J_L) * 2 * per_turn), rel=0.15)


def test_a_payload_that_goes_leaves_the_speed_and_quickens_the_bus(lossless, trace):
    p = lossless._replace(payload_share=-0.3, payload_at_s=2.0, payload_rise_s=0.2)
    coasting = trace(p, [0.0] * 400, speed_rad_s=40.0)
    np.testing.assert_allclose(coasting[:, StateIndex.SPEED_M], 40.0, rtol=1e-9)
    driven = trace(p._replace(c=60.0), [100.0] * 600)
    momentum_m, momentum_l = p.J_M * driven[:, StateIndex.SPEED_M], driven[:, StateIndex.SPEED_L]
    first, last = slice(100, 200), slice(400, 600)
    for part, share in ((first, 1.0), (last, 0.7)):
        rate = np.gradient(momentum_m[part] + share * p.J_L * momentum_l[part], 0.01)
        assert rate.mean() == pytest.approx(100.0, rel=0.01)


EFFECTS = {
    "nothing": {},
    "friction": {"friction_motor_nm": 20.0},
    "drag": {"quadratic_motor": 0.02, "quadratic_load": 0.01},
    "gain": {"gain_m1": 0.9},
    "late": {"delay_s": 0.03, "current_loop_time_s": 0.02},
    "gap": {"gap_rad": 0.03},
}


@pytest.mark.parametrize("speed", [0.0, 70.0])
@pytest.mark.parametrize("changes", EFFECTS.values(), ids=EFFECTS)
def test_a_held_pedal_holds_the_speed(plain, changes, speed):
    rolling = bring_to_speed(plain._replace(load_torque_nm=50.0, **changes), speed, share_m1=0.4)
    start = rolling.driveline.quantity(StateIndex.SPEED_L)
    rolling.driveline.advance((0.4 * rolling.torque_nm, 0.6 * rolling.torque_nm), 10.0)
    assert start == pytest.approx(speed, abs=0.4)
    assert rolling.driveline.quantity(StateIndex.SPEED_L) == pytest.approx(start, abs=0.05)


def test_hills_and_brake_begin_with_the_recording(plain):
    p = plain._replace(brake_nm=50.0, brake_from_s=0.0, brake_to_s=10.0)
    driveline = bring_to_speed(p, 60.0, 0.5).driveline
    assert driveline.quantity(StateIndex.SPEED_L) == pytest.approx(60.0, abs=0.4)
    assert driveline.quantity(StateIndex.TIME_S) == 0.0
    assert driveline.quantity(StateIndex.ANGLE_L) == 0.0
    assert driveline.physics == p
