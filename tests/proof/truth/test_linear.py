"""The linear driveline against closed solutions: matrix exponential, eigenvalues, energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from hil.proof.truth import laws
from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.physics import StateIndex


def _system(p):
    """States [phi_M, phi_L, w_M, w_L], input torque."""
    A = np.array(
        [
            [0, 0, 1, 0],
            [0, 0, 0, 1],
            [-p.k / p.J_M, p.k / p.J_M, -(p.c + p.b_M) / p.J_M, p.c / p.J_M],
            [p.k / p.J_L, -p.k / p.J_L, p.c / p.J_L, -(p.c + p.b_L) / p.J_L],
        ]
    )
    return A, np.array([0, 0, 1 / p.J_M, 0])


def _sampled(p, period_s):
    A, b = _system(p)
    joined = np.zeros((5, 5))
    joined[:4, :4], joined[:4, 4] = A, b
    whole = expm(joined * period_s)
    return whole[:4, :4], whole[:4, 4]


def test_follows_the_matrix_exponential_under_held_torques(plain, trace):
    rng = np.random.default_rng(1)
    torques = 150.0 * rng.choice([-1.0, 1.0], 500)
    states = trace(plain, torques)
    Phi, gamma = _sampled(plain, 0.01)
    x = np.zeros(4)
    for k, torque in enumerate(torques):
        np.testing.assert_allclose(states[k, :4], x, rtol=0, atol=2e-4)
        x = Phi @ x + gamma * torque


def test_one_long_advance_is_many_short_ones(plain):
    once, often = TruthDriveline(plain, 10.0), TruthDriveline(plain, 10.0)
    once.advance((100.0, 60.0), 0.5)
    for _ in range(50):
        often.advance((100.0, 60.0), 0.01)
    np.testing.assert_allclose(once.state, often.state, rtol=1e-12)


def _rates(_, y, p, torque):
    angle_m, angle_l, speed_m, speed_l, bristle, maxwell, inverter = y
    sliding = laws.sliding_torque(p.friction_motor_nm, p.breakaway_motor_nm, p.stribeck_speed_rad_s, speed_m)
    limit = sliding / p.friction_motor_nm
    friction = laws.friction_torque(p.friction_motor_nm, limit, bristle, speed_m)
    shaft = laws.shaft_torque(p, angle_m - angle_l, speed_m - speed_l) + maxwell
    return [
        speed_m,
        speed_l,
        (inverter - p.b_M * speed_m - shaft - friction) / p.J_M,
        (shaft - p.b_L * speed_l - p.load_torque_nm) / p.J_L,
        (speed_m - abs(speed_m) * bristle / limit) / laws.PRESLIDING_RAD,
        p.maxwell_stiffness * (speed_m - speed_l) - maxwell / p.maxwell_time_s,
        (torque - inverter) / p.current_loop_time_s,
    ]


def test_agrees_with_a_stiff_integration_of_two_masses_and_all_their_laws(plain, trace):
    p = plain._replace(
        load_torque_nm=40.0,
        friction_motor_nm=15.0,
        breakaway_motor_nm=30.0,
        stribeck_speed_rad_s=1.5,
        gap_rad=0.015,
        hardening_twist_rad=0.08,
        maxwell_stiffness=1500.0,
        maxwell_time_s=0.02,
        current_loop_time_s=0.008,
    )
    rng = np.random.default_rng(5)
    torques = 180.0 * rng.choice([-1.0, 1.0], 60) + 40.0
    states = trace(p, torques)
    y = np.zeros(7)
    speeds = []
    for torque in torques:
        y = solve_ivp(_rates, (0.0, 0.01), y, method="LSODA", args=(p, torque), rtol=1e-8, atol=1e-10).y[:, -1]
        speeds.append(y[2])
    assert np.any(np.diff(np.sign(speeds)))  # the friction did reverse
    np.testing.assert_allclose(states[1:, StateIndex.SPEED_M], speeds, atol=0.002)  # noise is 0.05 rad/s


def _longer_rates(time_s, y, p, torque):
    motor, extra, load = y[:3]
    w_m, w_x, w_l, w_v, slip, bristle, filtered, rate = y[3:]
    before, behind, first, last = (motor, extra, w_m, w_x) if p.extra_at_motor else (extra, load, w_x, w_l)
    link = p.extra_stiffness * (before - behind) + p.extra_damping * (first - last)
    driving, driven, fast, slow = (extra, load, w_x, w_l) if p.extra_at_motor else (motor, extra, w_m, w_x)
    angle, slope = laws.through_joint(p, driving)
    stiffness = laws.stiffness_over_k(p, time_s, fast)
    shaft = laws.shaft_torque(p, angle - driven, slope * fast - slow, stiffness)
    on_motor, on_extra, on_load = (
        (-link, link - slope * shaft, shaft) if p.extra_at_motor else (-slope * shaft, shaft - link, link)
    )
    given = torque + laws.ripple_torque(p, motor, torque)
    rolling = laws.tyre_torque(p, slip, w_l, w_v)
    held = laws.friction_torque(p.friction_load_nm, 1.0, bristle, w_l)
    axle = p.b_L * laws.viscosity_over_warm(p, time_s) * w_l + laws.imbalance_torque(p, load)
    vehicle = p.J_L * laws.mass_over_empty(p, time_s) - p.wheel_inertia
    return [
        w_m,
        w_x,
        w_l,
        (given - p.b_M * w_m - laws.eddy_torque(p, w_m) + on_motor) / p.J_M,
        on_extra / p.extra_inertia,
        (on_load - axle - held - rolling) / p.wheel_inertia,
        (rolling - p.load_torque_nm - p.quadratic_load * w_v * abs(w_v)) / vehicle,
        (w_l - w_v - abs(w_v) * slip) / p.relaxation_rad,
        (w_l - abs(w_l) * bristle) / laws.PRESLIDING_RAD,
        p.filter_rad_s * rate,
        p.filter_rad_s * (w_m - filtered - 2.0 * p.filter_damping * rate),
    ]


@pytest.mark.campaign
@pytest.mark.parametrize("at_motor", [True, False])
def test_agrees_with_a_stiff_integration_of_four_masses_and_their_laws(plain, trace, at_motor):
    p = plain._replace(
        load_torque_nm=40.0,
        extra_at_motor=at_motor,
        extra_inertia=0.6,
        extra_stiffness=15000.0,
        extra_damping=4.0,
        joint_angle_rad=0.2,
        stiffness_step=-0.2,
        stiffness_step_at_s=0.2,
        stiffness_step_rise_s=0.05,
        ripple_nm=15.0,
        ripple_order=4.0,
        eddy_nm=20.0,
        eddy_speed_rad_s=5.0,
        wheel_inertia=4.0,
        slip_stiffness_nm=3e4,
        grip_nm=900.0,
        relaxation_rad=4.0,
        imbalance_nm=60.0,
        gear_ratio=5.6,
        friction_load_nm=20.0,
        quadratic_load=0.05,
        cold_factor=2.0,
        payload_share=-0.3,
        payload_at_s=0.1,
        payload_rise_s=0.3,
        filter_rad_s=120.0,
        filter_damping=0.8,
    )
    rng = np.random.default_rng(5)
    torques = 180.0 * rng.choice([-1.0, 1.0], 60) + 40.0
    states = trace(p, torques)
    y = np.zeros(11)
    followed = []
    for row, torque in enumerate(torques):
        span = (0.01 * row, 0.01 * (row + 1))
        y = solve_ivp(_longer_rates, span, y, method="LSODA", args=(p, torque), rtol=1e-7, atol=1e-9).y[:, -1]
        followed.append([y[3], y[6], y[9]])
    read = states[1:, [StateIndex.SPEED_M, StateIndex.SPEED_V, StateIndex.FILTERED]]
    assert np.any(np.diff(np.sign(read[:, 1])))  # the vehicle did reverse
    np.testing.assert_allclose(read[:, :2], np.array(followed)[:, :2], atol=0.004)  # noise is 0.05 rad/s
    np.testing.assert_allclose(read[:, 2], np.array(followed)[:, 2], atol=0.03)  # 0.1 ms of 250 rad/s^2
