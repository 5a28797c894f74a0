"""The stepper is the simulation, one period at a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics import kernel
from estimator.physics.layout import flat
from estimator.physics.simulate import Start, grid_for, simulate
from estimator.physics.stepper import SIGN_WIDTH_RAD_S, Stepper
from tests.estimator.physics.bench import ONE_MASS, SAMPLE_TIME_S, TWO_MASS, model, random_steps, record

LINES = {
    "two_mass": model(TWO_MASS),
    "one_mass": model(ONE_MASS),
    "delay": model(TWO_MASS, effects={"transport_delay": {"delay_s": 0.023}}),
    "whole_delay": model(TWO_MASS, effects={"transport_delay": {"delay_s": 0.03}}),
    "lag": model(TWO_MASS, effects={"actuator_lag": {"time_constant_s": 0.04}}),
    "friction": model(ONE_MASS, effects={"coulomb_friction_motor": {"friction_nm": 20.0}}),
    "backlash": model(TWO_MASS, effects={"backlash": {"gap_rad": 0.02, "contact_rad": 1e-3}}),
    "chain": model(
        TWO_MASS,
        effects={
            "transport_delay": {"delay_s": 0.015},
            "actuator_lag": {"time_constant_s": 0.02},
            "stiffness_nonlinearity": {"hardening_per_rad2": 100.0, "shape": 1.0},
        },
    ),
}


@pytest.mark.parametrize("name", LINES)
def test_the_stepper_equals_the_simulation_from_rest(name: str) -> None:
    line = LINES[name]
    torque = np.concatenate([[0.0], random_steps(250, seed=1)])
    stepper = Stepper(line, SAMPLE_TIME_S, load_torque_nm=15.0)
    stepped = []
    for value in torque:
        stepped.append((stepper.speed_rad_s, stepper.angle_rad))
        stepper.step(value)
    rec = record(torque, np.ones(torque.size))
    grid = replace(grid_for(line, [rec]), sign_width=SIGN_WIDTH_RAD_S)
    start = Start(15.0, 0.0, 0.0)
    for column, state in enumerate((kernel.SPEED, kernel.ANGLE)):
        whole = simulate(grid, rec, flat(line), start, output=state)
        np.testing.assert_allclose([row[column] for row in stepped], whole, rtol=0, atol=1e-9 * np.ptp(whole))


def test_a_step_of_one_mass_is_newtons_law() -> None:
    stepper = Stepper(model({"J_M": 2.0, "b_M": 0.0}), 0.5, load_torque_nm=1.0)
    assert (stepper.speed_rad_s, stepper.angle_rad) == (0.0, 0.0)
    stepper.step(5.0)
    assert stepper.speed_rad_s == pytest.approx(4.0 / 2.0 * 0.5)
    assert stepper.angle_rad == pytest.approx(0.5 * 2.0 * 0.5**2)


def test_a_delayed_torque_acts_only_after_its_delay() -> None:
    stepper = Stepper(model({"J_M": 2.0, "b_M": 0.0}, effects={"transport_delay": {"delay_s": 0.02}}), 0.01)
    speeds = []
    for torque in (5.0, 0.0, 0.0, 0.0):
        stepper.step(torque)
        speeds.append(stepper.speed_rad_s)
    np.testing.assert_allclose(speeds, [0.0, 0.0, 5.0 / 2.0 * 0.01, 5.0 / 2.0 * 0.01], atol=1e-15)
