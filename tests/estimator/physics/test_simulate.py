"""Grid, outputs, and refusal of outputs that a structure does not have."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.assemble import load_torques
from estimator.diagnosis.covariance import reported_covariance
from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.errors import BadModel
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.fit import FitResult, fit, make_problem
from estimator.physics.free_run import free_run
from estimator.physics.layout import flat, flat_values, grid_for, slot, substeps_for
from estimator.physics.model import DrivelineModel, Load, Structure, natural_frequencies_rad_s
from estimator.physics.problem import bounds
from estimator.physics.simulate import output_state, simulate, simulate_each
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import Location, OutputKind, Record
from tests.estimator.physics.bench import (
    ONE_MASS,
    SAMPLE_TIME_S,
    TWO_MASS,
    assert_same_to_rounding,
    exact_states,
    linear_record,
    model,
    random_steps,
    record,
)

SIGMA = 0.02


def one_way(direction: float, seed: int, load_nm: float) -> Record:
    """A cruise in one direction; dry friction of 6 Nm at the motor is a constant torque there."""
    friction = 6.0 * direction
    torque = random_steps(1500, seed, size_nm=40.0, mean_nm=direction * 60.0 + load_nm + friction)
    start = InitialCondition(load_nm, 0.0, direction * 60.0, 0.0, direction * 60.0)
    plain = linear_record(TWO_MASS, torque - friction, start, sigma=SIGMA, seed=seed, name=f"run_{seed}")
    return replace(plain, torque_nm=torque[:, np.newaxis])


FORWARD, BACK = one_way(1.0, 1, 20.0), one_way(-1.0, 2, 20.0)


def with_load(load: Load | float) -> DrivelineModel:
    return replace(model(TWO_MASS, 0.02), load=load)


def fitted(load: Load | float) -> FitResult:
    line = with_load(load)
    return fit(make_problem(line, [FORWARD, BACK], nominal_unknowns(line)))


def count_free(result: FitResult) -> int:
    """Return how many unknowns a fit could change."""
    low, high = bounds(result.problem)
    return int(np.sum(low < high))


def test_its_own_takes_up_dry_friction_in_each_direction() -> None:
    result = fitted(Load.OWN)
    loads = [each.value for each in load_torques(result, reported_covariance(result), with_load(Load.OWN)).values()]
    assert loads == pytest.approx([26.0, 14.0], abs=1.0)
    assert result.rms == pytest.approx(SIGMA, rel=0.1)


@pytest.mark.parametrize("load", [Load.SHARED, 20.0])
def test_shared_or_known_it_leaves_dry_friction_to_be_seen(load: Load | float) -> None:
    result = fitted(load)
    loads = load_torques(result, reported_covariance(result), with_load(load))
    assert len({each.value for each in loads.values()}) == 1
    assert result.rms > 5.0 * SIGMA
    low, high = loads["run_1"].ci95
    assert (low == high) == (load == 20.0)
    free = fitted(Load.OWN)
    assert count_free(free) - count_free(result) == (1 if load is Load.SHARED else 2)


def test_dry_friction_is_reported_in_one_direction_where_the_load_is_known_or_shared_by_both() -> None:
    def tells(load: Load | float, *records: Record) -> bool:
        return "coulomb_friction_motor" in open_hypotheses(with_load(load), records)[0]

    assert not tells(Load.OWN, FORWARD, BACK)
    assert tells(Load.SHARED, FORWARD, BACK)
    assert not tells(Load.SHARED, FORWARD)
    assert tells(20.0, FORWARD)


START = InitialCondition(5.0, 0.0, 2.0)
TORQUE, LOAD = random_steps(400, 1), random_steps(400, 2, size_nm=60.0, hold=25)


def braked(values: dict[str, float], location: Location = Location.MOTOR) -> Record:
    """Return a recording in which the load machine's torque acts and is measured."""
    record = linear_record(values, TORQUE, START, extra_load_nm=LOAD, location=location)
    return replace(record, load_nm=LOAD)


@pytest.mark.parametrize("location", [Location.MOTOR, Location.LOAD])
def test_it_acts_at_the_load(location: Location) -> None:
    record, start = braked(TWO_MASS, location), START
    simulated = simulate(grid_for(model(TWO_MASS), [record]), record, flat_values(TWO_MASS, {}), start)
    np.testing.assert_allclose(simulated, record.output, atol=1e-3 * np.ptp(record.output))


def test_a_free_run_finds_the_constant_load_besides_it() -> None:
    record = braked(ONE_MASS)
    run = free_run(model(ONE_MASS), record)
    assert run.start.load_torque_nm == pytest.approx(START.load_torque_nm, abs=1e-3)
    assert run.rms < 1e-4 * np.ptp(record.output)
    without = free_run(model(ONE_MASS), replace(record, load_nm=None))
    assert without.rms > 0.1 * np.std(record.output)


def test_the_natural_frequencies_of_a_symmetric_chain() -> None:
    """Equal springs, masses 1, 2, 1: the ends against each other, then both against the middle."""
    values = {"J_M": 1.0, "J_2": 2.0, "J_L": 1.0, "k": 400.0, "k_2": 400.0}
    assert natural_frequencies_rad_s(values) == pytest.approx([20.0, 20.0 * np.sqrt(2.0)])


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"k": 4.2e12}, "parameters.k = 4.2e+12 with parameters.J_M = 2: the line's natural frequency is"),
        ({"J_L": 1e-9}, "parameters.k = 600 with parameters.J_L = 1e-09: the line's natural frequency is"),
        ({"c": 1e9}, "parameters.c = 1e+09 with parameters.J_M = 2: the line's fastest decay is"),
        ({"b_M": 1e9}, "parameters.b_M = 1e+09 with parameters.J_M = 2: the line's fastest decay is"),
        ({"b_L": 1e9}, "parameters.b_L = 1e+09 with parameters.J_L = 6: the line's fastest decay is"),
    ],
)
def test_a_mode_too_fast_for_the_sample_time_is_refused_with_its_parameter(
    changes: dict[str, float], named: str
) -> None:
    values = {"J_M": 2.0, "J_L": 6.0, "k": 600.0, "c": 0.0, "b_M": 0.0, "b_L": 0.0} | changes
    with pytest.raises(BadModel) as refusal:
        substeps_for(values, 0.01)
    assert str(refusal.value).startswith(named)
    assert "Hz, expected at most 1500 Hz at a sample time of 0.01 s" in str(refusal.value)


@pytest.mark.parametrize(
    "values",
    [
        TWO_MASS | {"k": 100.0, "c": 700.0},  # c / J_M = 437 1/s: one step per period would be unstable
        {"J_M": 0.01, "b_M": 4.0},
    ],
)
def test_a_fast_decay_is_integrated_as_well_as_a_fast_oscillation(values: dict[str, float]) -> None:
    torque = random_steps(200, seed=1)
    start = InitialCondition(5.0, 0.0, 0.0)
    line, rec = model(values), record(torque, np.ones(200))
    speed = simulate(grid_for(line, [rec]), rec, flat(line), start)
    exact = exact_states(values, torque, start)[:, 1]
    assert np.max(np.abs(speed - exact)) < 1e-4 * np.ptp(exact)


@pytest.mark.parametrize(
    ("kind", "location", "structure"),
    [
        (OutputKind.SPEED, Location.LOAD, Structure.ONE_MASS),
        (OutputKind.POSITION, Location.LOAD, Structure.ONE_MASS),
        (OutputKind.TORQUE, Location.SHAFT, Structure.ONE_MASS),
        (OutputKind.SPEED, Location.SHAFT, Structure.TWO_MASS),
        (OutputKind.FORCE, Location.MOTOR, Structure.TWO_MASS),
    ],
)
def test_an_output_that_the_structure_lacks_is_refused(
    kind: OutputKind, location: Location, structure: Structure
) -> None:
    rec = record(np.ones(5), name="bench_7", kind=kind, location=location)
    message = f"bench_7: {kind.value} at the {location.value} is no output of {structure.value}. Expected speed"
    with pytest.raises(BadModel, match=message):
        output_state(rec, structure)


def test_inputs_are_summed_and_row_k_is_the_state_before_torque_k_acts() -> None:
    torque = np.array([[3.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    rec = record(torque, np.ones(3))
    line = model({"J_M": 2.0, "b_M": 0.0})
    speed = simulate(grid_for(line, [rec]), rec, flat(line), InitialCondition(0.0, 0.0, 1.0))
    np.testing.assert_allclose(speed, [1.0, 1.0 + 2.0 * SAMPLE_TIME_S, 1.0 + 2.0 * SAMPLE_TIME_S])


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"transport_delay": {"delay_s": 0.013}},
        {"torque_ripple": {"amplitude_nm": 2.0}},
        {"clock_drift": {"rate": 0.01}},  # which looks at torques to come
    ],
)
def test_what_is_alike_up_to_a_moment_is_simulated_from_there(effects: Mapping[str, Mapping[str, float]]) -> None:
    """Through delay, filter, samples off their time, and whatever else has a memory."""
    bus = model(TWO_MASS)
    off_time = np.random.default_rng(4).uniform(-0.002, 0.002, 400)
    recording = replace(record(random_steps(400, seed=4)), offset_s=off_time)
    brake = {"brake_nm": 8.0, "from_s": 0.5, "to_s": 0.5}
    still = flat_values(bus.values(), {**effects, "speed_filter": {"time_constant_s": 0.03}, "brake_drag": brake})
    begins_s = np.array([0.5, 2.5, 0.0, 1.003, 3.99, 1.0])
    cases = [Case(still.copy(), InitialCondition(5.0, 0.0, 20.0, load_speed_rad_s=20.0)) for _ in begins_s]
    for case, begin in zip(cases[1:], begins_s[1:], strict=True):
        case.p[slot("brake_drag", "from_s")], case.p[slot("brake_drag", "to_s")] = begin, begin + 0.7
    grid = grid_for(bus, [recording])
    whole = simulate_each(grid, recording, cases)
    assert_same_to_rounding(simulate_each(grid, recording, cases, alike_s=begins_s), whole)
    assert min(np.ptp(out - whole[0]) for out in whole[[1, 2, 3, 5]]) > 0.1
