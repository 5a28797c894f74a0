"""Laws that their entries declare for a place of the simulation, and the shaft that relaxes, against the reference."""

import math
from dataclasses import replace

import numpy as np

from estimator.physics.layout import Grid, flat_values
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray, OutputKind
from tests.estimator.physics import reference
from tests.estimator.physics.bench import SAMPLE_TIME_S, TWO_MASS, model
from tests.estimator.physics.law_bench import (
    SIGN_WIDTH,
    START,
    SUBSTEPS,
    TIME_S,
    TORQUE,
    assert_law,
    assert_same,
    measured,
    solved,
    start_vector,
    two_mass,
)
from tests.estimator.physics.reference import Held


def test_an_eddy_drag_rises_to_its_peak_and_falls() -> None:
    line = two_mass(friction=lambda t, w: 60.0 * 2.0 * (w / 1.2) / (1.0 + (w / 1.2) ** 2))
    assert_law({"eddy_drag": {"peak_nm": 60.0, "peak_rad_s": 1.2}}, solved(line))


def test_friction_by_direction_is_more_one_way_than_the_other() -> None:
    line = two_mass(friction=lambda t, w: 9.0 * w if w > 0.0 else -9.0 * w)
    assert_law({"asymmetric_friction": {"difference_nm_s": 9.0}}, solved(line))


def test_gears_lose_more_when_the_load_drives_them() -> None:
    def line(t: float, x: FloatArray, torque: float) -> FloatArray:
        _, motor, twist, load = x
        carried = TWO_MASS["k"] * twist + TWO_MASS["c"] * (motor - load)
        lost = (0.1 if carried * load > 0.0 else 0.25) * abs(carried) * math.tanh(load / SIGN_WIDTH)
        return two_mass(drag=lambda t, w: lost)(t, x, torque)

    assert_law({"gear_losses": {"driving_share": 0.1, "back_share": 0.25}}, solved(line))


def test_a_torque_grows_less_than_its_reading_of_one_sign_more_than_of_the_other() -> None:
    given = np.where(TORQUE > 0.0, TORQUE * (1.0 - 1.2e-3 * TORQUE), TORQUE * (1.0 + 0.4e-3 * TORQUE))
    effects = {"torque_nonlinearity": {"curvature_per_nm": 0.8e-3, "asymmetry_per_nm": 0.4e-3}}
    assert_law(effects, solved(two_mass(), held=Held.of(given, SAMPLE_TIME_S)))


def test_an_offset_of_the_reading_is_there_at_once_or_comes() -> None:
    at_once = Held.of(TORQUE + 15.0, SAMPLE_TIME_S)
    assert_law({"torque_bias": {"offset_nm": 15.0}}, solved(two_mass(), held=at_once))
    drifting = Held.of(TORQUE + 40.0 * (1.0 - np.exp(-TIME_S / 0.8)), SAMPLE_TIME_S)
    assert_law({"torque_bias": {"offset_nm": 40.0, "time_constant_s": 0.8}}, solved(two_mass(), held=drifting))


def test_a_spring_to_the_ground_pulls_the_load_back() -> None:
    def line(t: float, x: FloatArray, torque: float) -> FloatArray:
        angle_of_load = x[reference.ANGLE] - (x[reference.TWIST] - START.twist_rad) - START.twist_rad
        return two_mass(drag=lambda t, w: 90.0 * angle_of_load)(t, x, torque)

    assert_law({"grounded_spring": {"stiffness_nm_per_rad": 90.0}}, solved(line))


def test_gravity_pulls_by_the_sine_of_the_recorded_angle() -> None:
    angle = 3.0 * np.sin(2.0 * TIME_S) - TIME_S
    rec = replace(measured(angle), kind=OutputKind.POSITION)
    grid = Grid(model(TWO_MASS).structure, SUBSTEPS, SIGN_WIDTH)

    def speed(effects: dict[str, dict[str, float]]) -> FloatArray:
        return simulate(grid, rec, flat_values(TWO_MASS, effects), START, output=reference.SPEED)

    def pulled(t: float, w: float) -> float:
        return 80.0 * math.sin(float(np.interp(t, TIME_S, angle)) / 1.5 + 0.7)

    effects = {"gravity": {"moment_nm": 80.0, "motor_turns_per_turn": 1.5, "phase_rad": 0.7}}
    assert_same(speed(effects), solved(two_mass(drag=pulled)), speed({}), tolerance=2e-4)


def test_a_branch_of_the_shaft_relaxes() -> None:
    share, time_s = 0.5, 0.03

    def line(t: float, x: FloatArray, torque: float) -> FloatArray:
        _, motor, twist, load = x[:4]
        carried = x[4] + TWO_MASS["k"] * twist + TWO_MASS["c"] * (motor - load)
        relaxing = share * TWO_MASS["k"] * (motor - load) - x[4] / time_s
        return np.append(two_mass(shaft=lambda t, e, r: carried)(t, x[:4], torque), relaxing)

    held = Held.of(TORQUE, SAMPLE_TIME_S)
    expected = reference.solve(line, np.append(start_vector(), 0.0), held, TIME_S)[:, reference.SPEED]
    assert_law({"viscoelastic_shaft": {"branch_share": share, "relaxation_s": time_s}}, expected)
