"""Simulations that go side by side, against the same ones by themselves."""

from collections.abc import Mapping

import numpy as np
import pytest

from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.layout import Grid, flat, slot
from estimator.physics.model import DrivelineModel, EffectValue, Parameter, Structure
from estimator.physics.simulate import simulate_each
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
ROWS = 11

Effects = Mapping[str, Mapping[str, float]]

SLIDER = {"shaft_hysteresis": {"friction_nm": 20.0, "yield_rad": 0.004, "sharpness": 0.7, "unloading": 0.6}}
QUADRATIC = {"quadratic_friction": {"quadratic_nm_s2": 0.01}}
ON_THE_SHAFT: dict[str, Effects] = {
    "slider": SLIDER,
    "slider inside": {"shaft_hysteresis": {**SLIDER["shaft_hysteresis"], "inside": 0.3}},
    "tyre that creeps": {"tyre_slip": {"slip_per_nm": 1e-4, "wheel_share": 0.1, "creep_rad_s": 5.0}},
    "tyre that rolls": {
        "tyre_slip": {
            "slip_per_nm": 1e-4,
            "wheel_share": 0.1,
            "creep_rad_s": 5.0,
            "relaxation_rad": 1.0,
            "carcass_s": 0.01,
            "grip_nm": 300.0,
        }
    },
    "tyre that rolls, brake that sticks": {
        "tyre_slip": {"slip_per_nm": 1e-4, "wheel_share": 0.1, "creep_rad_s": 5.0, "relaxation_rad": 1.0},
        "brake_drag": {"brake_nm": 30.0, "presliding_rad": 1e-4, "from_s": 0.5, "to_s": 1.5},
    },
    "slider and a load that sticks": SLIDER | {"coulomb_friction_load": {"friction_nm": 9.0, "presliding_rad": 1e-4}},
    "gap": {"backlash": {"gap_rad": 0.01, "contact_rad": 0.0005, "pull": 0.3}},
    "gap behind a delay": {"backlash": {"gap_rad": 0.01, "contact_rad": 0.0005, "pull": 0.3}}
    | {"transport_delay": {"delay_s": 0.013}},
    "gap behind a lag": {"backlash": {"gap_rad": 0.01, "contact_rad": 0.0005, "pull": 0.3}}
    | {"actuator_lag": {"time_constant_s": 0.03, "shape": 0.2}},
    "gap before a filter": {"backlash": {"gap_rad": 0.01, "contact_rad": 0.0005, "pull": 0.3}}
    | {"speed_filter": {"time_constant_s": 0.03, "shape": 0.2}},
    "gap with hard faces": {"backlash": {"gap_rad": 0.01, "contact_rad": 0.0, "pull": 0.0}},
    "hardening": {"stiffness_nonlinearity": {"hardening_per_rad2": 200.0, "shape": 1.2}},
    "two stages": {"stiffness_nonlinearity": {"hardening_per_rad2": 0.0, "stage_share": 0.4, "stage_rad": 0.004}},
    "softening": {"stiffness_nonlinearity": {"hardening_per_rad2": -200.0, "shape": 0.5}},
    "cardan": {"cardan_second_order": {"amplitude_nm": 3.0}},
    "slider, then a crack": SLIDER | {"stiffness_change": {"change": -0.3, "from_s": 1.0, "to_s": 2.503}},
    "slider and a mode": SLIDER
    | {"extra_torsional_mode": {"inertia_kg_m2": 0.3, "frequency_hz": 12.0, "damping_ratio": 0.05}},
}
EVERYWHERE: dict[str, Effects] = {
    "drag": QUADRATIC,
    "Stribeck": {"stribeck_friction": {"coulomb_nm": 5.0, "excess_nm": 8.0, "stribeck_rad_s": 3.0}},
    "drag and bristles": QUADRATIC | {"coulomb_friction_motor": {"friction_nm": 9.0, "presliding_rad": 1e-3}},
    "drag and a brake that sticks": QUADRATIC
    | {"brake_drag": {"brake_nm": 30.0, "presliding_rad": 1e-4, "from_s": 1.0, "to_s": 2.5}},
    "drag and dry friction": QUADRATIC | {"coulomb_friction_motor": {"friction_nm": 9.0}},
    "drag in steps": QUADRATIC | {"speed_quantisation": {"step_rad_s": 0.5}},
    "drag and a payload": QUADRATIC | {"inertia_change": {"change_kg_m2": 3.0, "from_s": 1.0, "to_s": 2.5}},
    "warming": {"warming_friction": {"cold_nm_s": 2.0, "time_constant_s": 1.5}},
    "drag and another clock": QUADRATIC | {"clock_drift": {"rate": 1e-3}, "transport_delay": {"delay_s": 0.004}},
    "ripple": {"torque_ripple": {"amplitude_nm": 3.0, "order": 6.0}},
    "drag before a resolver and a filter": QUADRATIC
    | {"resolver_error": {"once_rad": 0.02, "twice_rad": 0.01}, "speed_filter": {"time_constant_s": 0.03}},
}
LINES = [
    *((values, effects) for values in (TWO_MASS, THREE_MASS) for effects in (ON_THE_SHAFT | EVERYWHERE).values()),
    *((ONE_MASS, effects) for effects in EVERYWHERE.values()),
]
IDS = [f"{size}: {name}" for size in ("two", "three") for name in (*ON_THE_SHAFT, *EVERYWHERE)]
IDS += [f"one: {name}" for name in EVERYWHERE]


def line_with(values: Mapping[str, float], effects: Effects) -> DrivelineModel:
    if "k_2" not in values:
        return model(values, effects=effects)
    with_values = {name: {key: EffectValue(v) for key, v in e.items()} for name, e in effects.items()}
    return DrivelineModel(Structure.THREE_MASS, {n: Parameter(v, 0.2) for n, v in values.items()}, effects=with_values)


def cases_of(p: FloatArray, samples: int) -> list[Case]:
    """Return lines that differ by per cents in every parameter, under loads that do, too."""
    rng = np.random.default_rng(3)
    load = random_steps(samples, seed=8, size_nm=30.0, hold=25)
    lines = [np.where(p == 0.0, 0.0, p * (1.0 + 0.01 * rng.standard_normal(p.size))) for _ in range(ROWS)]
    return [Case(q, START, load * (1.0 + 0.01 * i)) for i, q in enumerate(lines)]


@pytest.mark.parametrize(("values", "effects"), LINES, ids=IDS)
def test_side_by_side_is_one_by_one(values: Mapping[str, float], effects: Effects) -> None:
    line = line_with(values, effects)
    grid, rec = Grid(line.structure, SUBSTEPS, 0.02), record(random_steps(400, seed=7), np.ones(400))
    cases = cases_of(flat(line), 400)
    together = simulate_each(grid, rec, cases)
    alone = np.array([simulate_each(grid, rec, [case])[0] for case in cases])
    assert_same_to_rounding(together, alone)


def test_lines_of_several_makes_in_any_order_are_each_as_alone() -> None:
    """Sliders, gaps, waves and linear ones: each is done next to its kin, wherever these stand."""
    makes = [ON_THE_SHAFT["slider"], ON_THE_SHAFT["gap"], EVERYWHERE["ripple"], {}]
    grid, rec = Grid(Structure.TWO_MASS, SUBSTEPS, 0.02), record(random_steps(400, seed=7), np.ones(400))
    cases = [case for effects in makes for case in cases_of(flat(line_with(TWO_MASS, effects)), 400)]
    mixed = [cases[i] for i in np.random.default_rng(6).permutation(len(cases))]
    together = simulate_each(grid, rec, mixed)
    alone = np.array([simulate_each(grid, rec, [case])[0] for case in mixed])
    assert_same_to_rounding(together, alone)


@pytest.mark.parametrize("place", ["between_kg_m2", "behind_kg_m2"])
def test_a_mode_within_a_nonlinear_line(place: str) -> None:
    line = model(TWO_MASS, effects=SLIDER)
    p = flat(line)
    p[slot("extra_torsional_mode", place)] = 0.3
    p[slot("extra_torsional_mode", "line_share")] = 0.6
    grid, rec = Grid(line.structure, SUBSTEPS, 0.02), record(random_steps(400, seed=7), np.ones(400))
    cases = cases_of(p, 400)
    assert_same_to_rounding(
        simulate_each(grid, rec, cases), np.array([simulate_each(grid, rec, [case])[0] for case in cases])
    )


def test_what_has_its_beginning_in_common_continues_from_there() -> None:
    """Lines that crack at different moments: each is as the first one until shortly before its own."""
    effects = SLIDER | {"stiffness_change": {"change": -0.3, "from_s": 0.0, "to_s": 0.0}}
    line = model(TWO_MASS, effects=effects)
    grid, rec = Grid(line.structure, SUBSTEPS, 0.02), record(random_steps(400, seed=7), np.ones(400))
    begins = np.concatenate([[5.0], np.random.default_rng(2).uniform(0.5, 3.5, 2 * ROWS)])
    cases = []
    for begin in begins:
        p = flat(line)
        p[slot("stiffness_change", "from_s")], p[slot("stiffness_change", "to_s")] = begin, 6.0
        cases.append(Case(p, START))
    together = simulate_each(grid, rec, cases, alike_s=np.minimum(begins, 3.9))
    alone = np.array([simulate_each(grid, rec, [case])[0] for case in cases])
    assert_same_to_rounding(together, alone)
