"""A plant that another program simulates, around which the catalogue's effects act: here that program is this one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.black_box import BlackBox, PlantSetting, equivalent_line
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.free_run import free_run
from estimator.physics.layout import flat, grid_for, slot
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.parallel import TimeIsUp
from estimator.physics.simulate import simulate, simulate_each
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, random_steps, record

START = InitialCondition(12.0, 0.0, 5.0, 0.01, 4.0)
STATES = ("speed_rad_s", "twist_rad", "load_speed_rad_s")

EXACT, IN_PARTS = 1e-7, 2e-3
"""Of the output's range: rounding; and what a torque that changes within a period loses, held over half of it."""

AROUND = {
    "inverter_gain_mismatch": ({"gain_m2": 0.8}, EXACT),
    "torque_derating": ({"depth": 0.3, "time_constant_s": 2.0}, EXACT),
    "torque_saturation": ({"limit_m1_nm": 20.0, "limit_sum_nm": 30.0}, EXACT),
    "torque_nonlinearity": ({"curvature_per_nm": 1e-3}, EXACT),
    "torque_bias": ({"offset_nm": 5.0, "time_constant_s": 1.0}, EXACT),
    "resolver_error": ({"once_rad": 0.02, "twice_rad": 0.01, "once_phase_rad": 0.7}, EXACT),
    "speed_sign_blind": ({"share": 1.0}, EXACT),
    "speed_quantisation": ({"step_rad_s": 0.25}, EXACT),
    "speed_filter": ({"time_constant_s": 0.03}, IN_PARTS),
    "transport_delay": ({"delay_s": 0.013}, IN_PARTS),
    "actuator_lag": ({"time_constant_s": 0.02}, IN_PARTS),
}


def line_of(values: dict[str, float], structure: Structure) -> DrivelineModel:
    return DrivelineModel(structure, {name: Parameter(value, 0.0) for name, value in values.items()})


def boxed(line: DrivelineModel) -> DrivelineModel:
    """Return a model whose plant is a line, simulated as another program would."""

    def run(on: Record, around: PlantSetting) -> FloatArray:
        driven = replace(on, torque_nm=around.torque_nm)
        alone = replace(around.start, load_torque_nm=0.0)
        return simulate(grid_for(line, [on]), driven, flat(line), alone, around.load_nm)

    return replace(line, plant=BlackBox(run, STATES, line, has_start=True))


def given(name: str, line: DrivelineModel) -> Case:
    p = flat(line)
    for key, value in AROUND[name][0].items():
        p[slot(name, key)] = value
    return Case(p, START)


@pytest.fixture
def driven() -> Record:
    first, second = (random_steps(600, seed, size_nm=60.0, mean_nm=8.0) for seed in (1, 2))
    return record(np.column_stack([first, second]))


@pytest.mark.parametrize("name", AROUND)
def test_an_effect_acts_as_in_the_simulation(name: str, driven: Record) -> None:
    line = line_of(TWO_MASS, Structure.TWO_MASS)
    around, inside = boxed(line), given(name, line)
    expected = simulate_each(grid_for(line, [driven]), driven, [inside])[0]
    found = simulate_each(grid_for(around, [driven]), driven, [inside])[0]
    assert np.abs(found - expected).max() <= AROUND[name][1] * np.ptp(expected)


def test_what_a_parameter_changes_is_that_of_the_line(driven: Record) -> None:
    line = line_of(TWO_MASS, Structure.TWO_MASS)
    around, case = boxed(line), given("torque_bias", line)
    grid = grid_for(around, [driven])
    base = simulate_each(grid, driven, [case])[0]
    p = case.p.copy()
    p[slot("torque_bias", "offset_nm")] += 1e-5
    moved = [replace(case, p=p), replace(case, start=replace(START, load_torque_nm=12.001))]
    found = simulate_each(grid, driven, moved) - base
    own = grid_for(line, [driven])
    expected = simulate_each(own, driven, moved) - simulate_each(own, driven, [case])[0]
    assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("structure", "values"), [(Structure.ONE_MASS, ONE_MASS), (Structure.TWO_MASS, TWO_MASS)], ids=["one", "two"]
)
def test_the_line_that_answers_alike_is_found(structure: Structure, values: dict[str, float], driven: Record) -> None:
    line = line_of(values, structure)
    answered = replace(driven, output=simulate(grid_for(line, [driven]), driven, flat(line), START))
    found = equivalent_line([answered])
    assert found.structure is structure
    assert free_run(found, answered).rms < 0.01 * np.std(answered.output)


def test_nothing_inside_is_a_hypothesis(driven: Record) -> None:
    line = line_of(TWO_MASS, Structure.TWO_MASS)
    reversing = replace(driven, output=10.0 * np.sin(driven.time_s))
    known = open_hypotheses(boxed(line), [reversing])
    named = {*known[0], *known[1]}
    assert {"transport_delay", "torque_bias", "resolver_error", "road_grade", "clock_drift"} <= named
    assert not named & {"backlash", "coulomb_friction_motor", "brake_drag", "inertia_change", "eddy_drag"}


def test_when_a_plant_answers_no_more_nothing_is_decided(driven: Record) -> None:
    """Its process was ended with the limit of time: the last words do without it."""

    def ended(_on: Record, _around: PlantSetting) -> FloatArray:
        raise TimeIsUp

    line = line_of(TWO_MASS, Structure.TWO_MASS)
    shown = replace(driven, output=simulate(grid_for(line, [driven]), driven, flat(line), START))
    answer = diagnose([shown], replace(line, plant=BlackBox(ended, STATES, line, has_start=True)), budget_s=0.0)
    assert answer.statement.startswith("Not decided: the search was ended after 0 s")
    assert "free-run error" not in answer.statement
    assert np.isnan(answer.fit.retuned)
    assert (answer.effects, answer.parameters, answer.load_torque) == ((), {}, {})


def test_what_comes_to_be_known_in_another_order_changes_nothing(driven: Record) -> None:
    line, found = line_of(TWO_MASS, Structure.TWO_MASS), []
    case = given("torque_bias", line)
    p, far = case.p.copy(), case.p.copy()
    p[slot("torque_bias", "offset_nm")] *= 1.0 + 1e-5
    far[slot("torque_bias", "offset_nm")] *= 1.5
    known = [case, replace(case, p=far)]
    for order in (known, known[::-1]):
        grid = grid_for(boxed(line_of({**TWO_MASS, "k": 1.1 * TWO_MASS["k"]}, Structure.TWO_MASS)), [driven])
        for each in order:
            simulate_each(grid, driven, [each])
        found.append(simulate_each(grid, driven, [replace(case, p=p), replace(case, p=p)]))
    np.testing.assert_array_equal(found[0], found[1])
