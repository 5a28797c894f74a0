"""Two simulators that share nothing agree on what both can express: neither has a wrong equation."""

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.simulate import simulate
from estimator.signals.record import Record
from hil.proof.truth.driveline import bring_to_speed
from hil.proof.truth.physics import Physics, StateIndex

NOMINAL = {"J_M": 1.7, "J_L": 95.0, "k": 4200.0, "c": 11.0, "b_M": 0.35, "b_L": 0.9}
LOAD_NM = 50.0
SPEED_RAD_S = 3.0
"""Low enough that the test below reverses."""

SAME = [
    ({}, {}, 1e-3),
    ({"derating": 0.3, "derating_time_s": 2.0}, {"torque_derating": {"depth": 0.3, "time_constant_s": 2.0}}, 1e-3),
    (
        {"limit_total_nm": 150.0, "limit_knee": 8.0},
        {"torque_saturation": {"limit_sum_nm": 150.0, "sharpness": 8.0}},
        1e-3,
    ),
    ({"current_loop_time_s": 0.012}, {"actuator_lag": {"time_constant_s": 0.012}}, 7e-3),
    ({"delay_s": 0.013}, {"transport_delay": {"delay_s": 0.013}}, 5e-3),
    ({"friction_motor_nm": 20.0}, {"coulomb_friction_motor": {"friction_nm": 20.0}}, 0.05),
    ({"friction_load_nm": 20.0}, {"coulomb_friction_load": {"friction_nm": 20.0}}, 4e-3),
    ({"quadratic_motor": 0.3}, {"quadratic_friction": {"quadratic_nm_s2": 0.3}}, 1e-3),
    ({"quadratic_load": 0.3}, {"aerodynamic_drag": {"drag_nm_s2": 0.3}}, 1e-3),
    ({"filter_time_s": 0.012}, {"speed_filter": {"time_constant_s": 0.012}}, 7e-3),
    # tau = 2 D / w, shape = 1 / (2 D)^2; 0.1 ms late by the firmware's cycle, at 150 rad/s^2
    (
        {"filter_rad_s": 120.0, "filter_damping": 0.8},
        {"speed_filter": {"time_constant_s": 1.6 / 120.0, "shape": 1.0 / 1.6**2}},
        2e-2,
    ),
    # the two contact laws differ in how damping sets in at the first touch
    ({"gap_rad": 0.02}, {"backlash": {"gap_rad": 0.02, "contact_rad": 1e-4}}, 0.15),
]


def _drive(changes):
    rng = np.random.default_rng(8)
    rolling = bring_to_speed(Physics(**NOMINAL, load_torque_nm=LOAD_NM, **changes), SPEED_RAD_S, 0.5)
    bus, steady = rolling.driveline, rolling.torque_nm
    torque = steady + np.repeat(150.0 * rng.choice([-1.0, 1.0], 100), 3) + np.linspace(60.0, -260.0, 300)
    torque[:20] = steady
    start, speed = bus.state, np.empty(torque.size)
    for row, both in enumerate(torque):
        speed[row] = bus.speed_rad_s
        bus.advance((0.5 * both, 0.5 * both), 0.01)
    return start, torque, speed


@pytest.mark.parametrize(("changes", "effects", "rms_rad_s"), SAME, ids=lambda value: str(value)[:30])
def test_the_model_that_is_fitted_and_the_truth_agree(changes, effects, rms_rad_s):
    start, torque, speed = _drive(changes)
    model = DrivelineModel(Structure.TWO_MASS, {name: Parameter(value, 0.2) for name, value in NOMINAL.items()})
    time_s = np.arange(torque.size) * 0.01
    record = Record("truth", 0.01, time_s, torque[:, None], speed, np.ones(torque.size, dtype=bool))
    started = InitialCondition(
        load_torque_nm=LOAD_NM,
        angle_rad=0.0,
        speed_rad_s=start[StateIndex.SPEED_M],
        twist_rad=start[StateIndex.ANGLE_M] - start[StateIndex.ANGLE_L],
        load_speed_rad_s=start[StateIndex.SPEED_L],
    )
    simulated = simulate(grid_for(model, [record]), record, flat_values(NOMINAL, effects), started)
    assert np.sqrt(np.mean((simulated - speed) ** 2)) < rms_rad_s
    assert speed.min() < 0.0 < speed.max()


def test_the_agreement_would_notice_a_missing_effect():
    _, _, without = _drive({})
    for changes, _, rms_rad_s in SAME[1:]:
        _, _, with_it = _drive(changes)
        assert np.sqrt(np.mean((with_it - without) ** 2)) > 4.0 * rms_rad_s
