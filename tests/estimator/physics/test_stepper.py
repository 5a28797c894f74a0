"""The stepper is the simulation, one period at a time."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.catalogue import EFFECTS as CATALOGUE
from estimator.physics.driveline import InitialCondition
from estimator.physics.kernel import state_vector
from estimator.physics.layout import flat, grid_for
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.simulate import FINER, SIGN_WIDTH_RAD_S, Stepper, simulate
from estimator.signals.record import FloatArray, OutputKind, Record
from tests.estimator.physics.bench import ONE_MASS, SAMPLE_TIME_S, THREE_MASS, TWO_MASS, model, random_steps, record


def effect_of(case: str) -> str:
    return case.partition("/")[0]


EFFECTS: dict[str, dict[str, float]] = {
    "inverter_gain_mismatch": {"gain_m1": 1.2},
    "torque_derating": {"depth": 0.4, "time_constant_s": 0.8},
    "torque_derating/heated": {"depth": 0.4, "time_constant_s": 0.8, "heating_nm": 60.0},
    "torque_saturation": {"limit_sum_nm": 80.0},
    "actuator_lag": {"time_constant_s": 0.04},
    "transport_delay": {"delay_s": 0.023},
    "coulomb_friction_motor": {"friction_nm": 20.0},
    "stribeck_friction": {"excess_nm": 15.0, "coulomb_nm": 10.0, "stribeck_rad_s": 0.5},
    "stribeck_friction/bristles": {
        "excess_nm": 15.0,
        "coulomb_nm": 10.0,
        "stribeck_rad_s": 0.5,
        "presliding_rad": 2e-3,
    },
    "quadratic_friction": {"quadratic_nm_s2": 2.0},
    "generator_coupled": {"inertia_kg_m2": 1.5, "from_s": 0.5, "to_s": 1.503},
    "backlash": {"gap_rad": 0.02, "contact_rad": 1e-3},
    "stiffness_nonlinearity": {"hardening_per_rad2": 100.0, "shape": 1.0},
    "stiffness_nonlinearity/stages": {"hardening_per_rad2": 0.0, "stage_share": 0.4, "stage_rad": 0.004},
    "stiffness_change": {"change": -0.3, "from_s": 0.5, "to_s": 1.503},
    "shaft_hysteresis": {"friction_nm": 20.0, "yield_rad": 3e-3},
    "extra_torsional_mode": {"inertia_kg_m2": 0.3, "frequency_hz": 12.0, "damping_ratio": 0.05},
    "coulomb_friction_load": {"friction_nm": 20.0},
    "coulomb_friction_load/bristles": {"friction_nm": 20.0, "presliding_rad": 2e-3},
    "brake_drag/bristles": {"brake_nm": 30.0, "presliding_rad": 2e-3, "from_s": 0.5, "to_s": 1.503},
    "aerodynamic_drag": {"drag_nm_s2": 5.0},
    "brake_drag": {"brake_nm": 30.0, "from_s": 0.5, "to_s": 1.503},
    "tyre_slip": {"slip_per_nm": 1e-3, "wheel_share": 0.1, "creep_rad_s": 2.0},
    "tyre_slip/relaxing": {"slip_per_nm": 1e-3, "wheel_share": 0.1, "creep_rad_s": 2.0, "relaxation_rad": 2.0},
    "inertia_change": {"change_kg_m2": 25.0, "from_s": 0.5, "to_s": 1.503},
    "warming_friction": {"cold_nm_s": 15.0, "time_constant_s": 0.8},
    "speed_filter": {"time_constant_s": 0.03},
    "speed_sign_blind": {"share": 1.0},
    "speed_quantisation": {"step_rad_s": 0.25},
}
"""Effects that need no angle, each large enough to be seen."""

EFFECTS |= {name: dict(entry.example) for name, entry in CATALOGUE.items() if entry.example and not entry.phases}

PERIODIC: dict[str, dict[str, float]] = {
    "torque_ripple": {"amplitude_nm": 40.0, "order": 6.0, "phase_rad": 0.5},
    "torque_ripple/share": {"share": 0.4, "order": 2.0, "share_phase_rad": 0.5},
    "cardan_second_order": {"amplitude_nm": 40.0, "phase_rad": 0.5},
    "cardan_second_order/angle": {"angle_rad": 0.01, "angle_phase_rad": 0.5},
    "cardan_second_order/share": {"share": 0.4, "share_phase_rad": 0.5},
    "load_imbalance": {"amplitude_nm": 60.0, "motor_turns_per_turn": 2.0, "phase_rad": 0.5},
    "resolver_error": {"once_rad": 0.1, "twice_rad": 0.05},
}
"""Effects of the motor's angle: the stepper knows it, the simulation takes it from the record."""

PERIODIC |= {
    name: {**entry.example, **dict.fromkeys(entry.phases, 0.5)}
    for name, entry in CATALOGUE.items()
    if entry.example and entry.phases
}

ALONE = {case: model(TWO_MASS, effects={effect_of(case): values}) for case, values in EFFECTS.items()}
LINES = {
    **ALONE,
    "two_mass": model(TWO_MASS),
    "one_mass": model(ONE_MASS),
    "one_mass_with_friction": model(ONE_MASS, effects={"coulomb_friction_motor": {"friction_nm": 20.0}}),
    "one_mass_with_a_payload": model(ONE_MASS, effects={"inertia_change": EFFECTS["inertia_change"]}),
    "three_mass": DrivelineModel(Structure.THREE_MASS, {n: Parameter(v, 0.2) for n, v in THREE_MASS.items()}),
    "whole_delay": model(TWO_MASS, effects={"transport_delay": {"delay_s": 0.03}}),
    "chain": model(
        TWO_MASS,
        effects={
            "transport_delay": {"delay_s": 0.015},
            "actuator_lag": {"time_constant_s": 0.02},
            "stiffness_nonlinearity": {"hardening_per_rad2": 100.0, "shape": 1.0},
        },
    ),
}
TORQUE = np.concatenate([[0.0], random_steps(250, seed=1)])


def stepped(line: DrivelineModel) -> tuple[FloatArray, FloatArray]:
    """Return speed as read and angle at every sample of a run from rest."""
    stepper = Stepper(line, SAMPLE_TIME_S, load_torque_nm=15.0)
    rows = []
    for value in TORQUE:
        rows.append((stepper.speed_rad_s, stepper.angle_rad))
        stepper.step(value)
    speed, angle = np.array(rows).T
    return speed, angle


def simulated(line: DrivelineModel, rec: Record, output: int | None = None) -> FloatArray:
    coarse = grid_for(line, [rec])
    grid = replace(coarse, substeps=FINER * coarse.substeps, sign_width=SIGN_WIDTH_RAD_S)
    return simulate(grid, rec, flat(line), InitialCondition(15.0, 0.0, 0.0), output=output)


@pytest.mark.parametrize("name", LINES)
def test_the_stepper_equals_the_simulation_from_rest(name: str) -> None:
    line = LINES[name]
    rec = record(TORQUE, np.ones(TORQUE.size))
    speed, angle = stepped(line)
    for column, output in ((speed, None), (angle, state_vector.ANGLE)):
        whole = simulated(line, rec, output)
        np.testing.assert_allclose(column, whole, rtol=0, atol=1e-9 * np.ptp(whole))


@pytest.mark.parametrize("name", PERIODIC)
def test_the_stepper_turns_periodic_effects_by_its_own_angle(name: str) -> None:
    """Between samples it goes straight on where the simulation knows the next one: the second order of a period."""
    line = model(TWO_MASS, effects={effect_of(name): PERIODIC[name]})
    speed, angle = stepped(line)
    rec = record(TORQUE, angle, kind=OutputKind.POSITION)
    whole = simulated(line, rec, state_vector.SPEED)
    true = stepped(model(TWO_MASS))[0]
    if name == "resolver_error":  # a position does not pass the speed sensor
        off = 0.1 * np.cos(angle) + 2.0 * 0.05 * np.cos(2.0 * angle)
        np.testing.assert_allclose(speed, true * (1.0 + off), rtol=0, atol=1e-9 * np.ptp(true))
        return
    effect = np.max(np.abs(speed - true))
    assert effect > 0.02 * np.ptp(true)
    assert np.max(np.abs(speed - whole)) < 0.05 * effect
