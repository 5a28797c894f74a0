"""A linear line's sums of answers, against the Runge-Kutta steps that they are read off."""

from collections.abc import Mapping

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.kernel import linear, state_vector
from estimator.physics.kernel.conditions import Line
from estimator.physics.layout import Grid, flat, slot
from estimator.physics.model import DrivelineModel, EffectValue, Parameter, Structure
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray
from tests.estimator.physics.bench import (
    ONE_MASS,
    THREE_MASS,
    TWO_MASS,
    assert_same_to_rounding,
    model,
    random_steps,
    record,
)

START = InitialCondition(12.0, 0.3, 5.0, 0.01, 4.0, 0.004, 4.5)
SUBSTEPS = 5
NO_TORQUE_NM_S2 = 1e-300
"""A drag that adds nothing to any number, and is none of a linear line: it takes the sub-steps themselves."""

BRISTLES = {"coulomb_nm": 12.0, "excess_nm": 20.0, "stribeck_rad_s": 2.0, "presliding_rad": 2e-3}

STATES = (state_vector.ANGLE, state_vector.SPEED, state_vector.TWIST, state_vector.LOAD_SPEED)
EFFECTS: dict[str, Mapping[str, Mapping[str, float]]] = {
    "nothing": {},
    "delay": {"transport_delay": {"delay_s": 0.013}},
    "lag": {"actuator_lag": {"time_constant_s": 0.02}},
    "filter": {"speed_filter": {"time_constant_s": 0.03}},
    "drift": {"clock_drift": {"rate": 0.01}},
    "mode next to": {"extra_torsional_mode": {"inertia_kg_m2": 0.3, "frequency_hz": 12.0, "damping_ratio": 0.05}},
    "dry friction": {"coulomb_friction_motor": {"friction_nm": 20.0}, "coulomb_friction_load": {"friction_nm": 9.0}},
    "bristles": {"stribeck_friction": BRISTLES, "coulomb_friction_load": {"friction_nm": 9.0}},
    "bristles at the load": {"coulomb_friction_load": {"friction_nm": 9.0, "presliding_rad": 1e-3}},
    "a brake that sticks": {"brake_drag": {"brake_nm": 30.0, "presliding_rad": 1e-4, "from_s": 0.5, "to_s": 1.503}},
    "a while": {"stiffness_change": {"change": -0.3, "from_s": 1.0, "to_s": 2.503}},
    "a brake": {"brake_drag": {"brake_nm": 30.0, "from_s": 0.5, "to_s": 1.503}},
    "a branch that relaxes": {"viscoelastic_shaft": {"branch_share": 0.4, "relaxation_s": 0.02}},
    "a spring to the ground": {"grounded_spring": {"stiffness_nm_per_rad": 300.0}},
    "an offset": {"torque_bias": {"offset_nm": 9.0, "time_constant_s": 1.0}},
    "Stribeck friction without excess": {
        "stribeck_friction": {"excess_nm": 0.0, "coulomb_nm": 20.0, "stribeck_rad_s": 2.0}
    },
    "a ripple": {"torque_ripple": {"amplitude_nm": 2.0, "order": 6.0}},
}
"""What makes the line nonlinear unless friction is described by bristles."""

LINES = {"one mass": ONE_MASS, "two masses": TWO_MASS, "three masses": THREE_MASS}
OUTSIDE_THE_LINE = ("delay", "lag", "filter", "drift", "an offset")
OF_ONE_MASS = (
    *("nothing", *OUTSIDE_THE_LINE, "a spring to the ground", "a brake", "a brake that sticks", "a ripple"),
    "Stribeck friction without excess",
)


def line_with(values: Mapping[str, float], effects: Mapping[str, Mapping[str, float]]) -> DrivelineModel:
    if "k_2" not in values:
        return model(values, effects=effects)
    with_values = {name: {key: EffectValue(v) for key, v in e.items()} for name, e in effects.items()}
    parameters = {name: Parameter(value, 0.2) for name, value in values.items()}
    return DrivelineModel(Structure.THREE_MASS, parameters, effects=with_values)


def both_ways(line: DrivelineModel, p: FloatArray, output: int | None) -> tuple[FloatArray, FloatArray]:
    """Return an output by sums where the line is linear, and by sub-steps alone."""
    rec = record(random_steps(400, seed=7), np.ones(400))
    grid, steps = Grid(line.structure, SUBSTEPS, 0.02), p.copy()
    steps[slot("aerodynamic_drag", "drag_nm_s2")] = NO_TORQUE_NM_S2
    load = random_steps(400, seed=8, size_nm=30.0, hold=25)
    return simulate(grid, rec, p, START, load, output), simulate(grid, rec, steps, START, load, output)


@pytest.mark.parametrize(
    ("values", "effects"), [(v, e) for v in LINES for e in EFFECTS if v != "one mass" or e in OF_ONE_MASS]
)
def test_sums_are_the_sub_steps(values: str, effects: str) -> None:
    line = line_with(LINES[values], EFFECTS[effects])
    outputs = [None, *STATES[: 2 if values == "one mass" else 4]]
    for output in outputs:
        assert_same_to_rounding(*both_ways(line, flat(line), output))


@pytest.mark.parametrize("place", ["between_kg_m2", "behind_kg_m2"])
@pytest.mark.parametrize("values", ["two masses", "three masses"])
def test_sums_are_the_sub_steps_of_a_mode_within_the_line(values: str, place: str) -> None:
    line = line_with(LINES[values], {})
    p = flat(line)
    p[slot("extra_torsional_mode", place)] = 0.3
    p[slot("extra_torsional_mode", "line_share")] = 0.6
    for output in (None, *STATES):
        assert_same_to_rounding(*both_ways(line, p, output))


def test_what_is_nonlinear_slips_or_drags_is_not_linear() -> None:
    elastic = Line(2, True, False, ())
    p = flat(model(TWO_MASS))
    assert linear.is_linear(elastic, p)
    assert not linear.is_linear(Line(2, False, False, ()), p)
    for effect, parameter in (
        ("quadratic_friction", "quadratic_nm_s2"),
        ("aerodynamic_drag", "drag_nm_s2"),
        ("stribeck_friction", "excess_nm"),
        ("tyre_slip", "slip_per_nm"),
    ):
        curved = p.copy()
        curved[slot(effect, parameter)] = 0.1
        assert not linear.is_linear(elastic, curved)
