"""The splitting against scipy's stiff integrator with error control, all laws at once."""

import numpy as np
from scipy.integrate import solve_ivp

from hil.proof.truth import laws
from hil.proof.truth.kernel import State


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


def test_agrees_with_a_stiff_integration_of_all_laws_at_once(plain, trace):
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
        y = solve_ivp(_rates, (0.0, 0.01), y, method="Radau", args=(p, torque), rtol=1e-8, atol=1e-10).y[:, -1]
        speeds.append(y[2])
    assert np.any(np.diff(np.sign(speeds)))  # the friction did reverse
    np.testing.assert_allclose(states[1:, State.SPEED_M], speeds, atol=0.002)  # noise is 0.05 rad/s
