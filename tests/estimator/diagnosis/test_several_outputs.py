"""Several measured outputs: each simulated as physics has it, all fitted at once, faulty ones left out by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.preconditions.channels import with_usable_channels
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.segments import as_slow_as_needed
from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import fit
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import Channel, FloatArray, Location, OutputKind, Record, separated_outputs, sliced
from tests.estimator.diagnosis.one_effect import Bench, bench_with
from tests.estimator.physics.bench import TWO_MASS

START = InitialCondition(5.0, 0.0, 2.0)
DRY = ("coulomb_friction_motor", {"friction_nm": 8.0})

Output = tuple[OutputKind, Location]
LOAD_SPEED: Output = (OutputKind.SPEED, Location.LOAD)
SHAFT_TORQUE: Output = (OutputKind.TORQUE, Location.SHAFT)
ACCELERATION: Output = (OutputKind.ACCELERATION, Location.MOTOR)
LOAD_ANGLE: Output = (OutputKind.POSITION, Location.LOAD)
NOISE = {LOAD_SPEED: 0.02, SHAFT_TORQUE: 2.0, ACCELERATION: 3.0, LOAD_ANGLE: 2e-3}


def true_output(bench: Bench, record: Record, output: Output, effects: Mapping[str, Mapping[str, float]]) -> FloatArray:
    as_it = replace(record, kind=output[0], location=output[1], lead=record)
    return simulate(grid_for(bench.model, [record]), as_it, flat_values(TWO_MASS, effects), START)


def channel_of(output: Output, values: FloatArray, label: str = "further") -> Channel:
    return Channel(*output, label, values, np.ones(values.shape, dtype=np.bool_))


def with_output(output: Output, name: str, values: Mapping[str, float]) -> Bench:
    """Return a bench whose recordings have a further output, with its noise."""
    bench, records = bench_with(name, values), []
    for seed, record in enumerate(bench.records):
        read = true_output(bench, record, output, {name: values})
        read = read + NOISE[output] * np.random.default_rng(seed).standard_normal(read.size)
        records.append(replace(record, channels=(channel_of(output, read),)))
    return Bench(bench.model, records)


def test_what_is_measured_follows_from_the_same_motion() -> None:
    """The angle is the speed's integral, and the shaft's torque moves the load: its balance is Newton's second law."""
    bench = bench_with(*DRY)
    (record, _), period_s = bench.records, bench.records[0].sample_time_s
    effects = {DRY[0]: DRY[1]}
    speed, angle, torque = (true_output(bench, record, o, effects) for o in (LOAD_SPEED, LOAD_ANGLE, SHAFT_TORQUE))
    mean = 0.5 * (speed[1:] + speed[:-1])
    assert np.std(np.diff(angle) / period_s - mean) < 0.01 * np.std(mean)  # a mean by the trapezoid's rule
    left = TWO_MASS["J_L"] * np.diff(speed) / period_s + 0.5 * TWO_MASS["b_L"] * (speed[1:] + speed[:-1])
    carried = 0.5 * (torque[1:] + torque[:-1]) - START.load_torque_nm
    assert np.std(carried - left) < 0.1 * np.std(left)  # a period is a fifth of a radian of the shaft's mode
    slope = true_output(bench, record, (OutputKind.ACCELERATION, Location.LOAD), effects)
    balance = (torque - START.load_torque_nm - TWO_MASS["b_L"] * speed) / TWO_MASS["J_L"]
    assert np.std((slope - balance)[1:-1]) < 0.02 * np.std(balance)


LONGER = [pytest.param(output, marks=pytest.mark.campaign) for output in (ACCELERATION, LOAD_SPEED, SHAFT_TORQUE)]
"""Outputs that the other tests here have, too."""


@pytest.mark.parametrize("output", [LOAD_ANGLE, *LONGER])
def test_an_effect_is_found_with_each_further_output(output: Output) -> None:
    bench = with_output(output, *DRY)
    answer = diagnose(bench.records, bench.model)
    assert answer.verdict is Verdict.EXPLAINED
    (found,) = answer.effects
    assert found.name == DRY[0]
    assert found.parameters["friction_nm"].value == pytest.approx(8.0, rel=0.03)
    (further,) = answer.fit.outputs
    assert (further.kind, further.at) == (output[0].value, output[1].value)
    assert further.augmented == pytest.approx(NOISE[output], rel=0.15)
    assert {trace.name for trace in answer.traces} == {record.name for record in bench.records}


@pytest.mark.campaign
def test_a_further_output_makes_the_values_surer() -> None:
    """A shaft's torque tells stiffness and damping without the motor's inertia in between."""
    alone, both = (
        diagnose(bench.records, bench.model) for bench in (bench_with(*DRY), with_output(SHAFT_TORQUE, *DRY))
    )

    def width(answer_c: tuple[float, float]) -> float:
        return answer_c[1] - answer_c[0]

    assert width(both.parameters["c"].ci95) < 0.5 * width(alone.parameters["c"].ci95)


@pytest.mark.campaign
def test_a_filter_of_one_sensor_is_no_lag_of_the_torque_once_another_sensor_has_seen_the_motion() -> None:
    filtered = ("speed_filter", {"time_constant_s": 0.01, "shape": 0.0})
    alone, both = (
        diagnose(bench.records, bench.model) for bench in (bench_with(*filtered), with_output(SHAFT_TORQUE, *filtered))
    )
    (one,), (other,) = alone.effects, both.effects
    assert {"actuator_lag", "speed_filter"} <= {one.name, *one.indistinguishable_from}
    assert other.name == "speed_filter"
    assert "actuator_lag" not in other.indistinguishable_from


def test_outputs_of_one_recording_share_its_start_and_load() -> None:
    bench = with_output(LOAD_SPEED, *DRY)
    apart = separated_outputs(bench.records, noise_floor)
    assert [each.lead for each in apart] == [None, None, apart[0], apart[1]]
    shared = nominal_unknowns(bench.model)
    alone, both = (make_problem(bench.model, records, shared) for records in (apart[:2], apart))
    assert fit(both).x.shape == fit(alone).x.shape
    first = fit(both).first_outputs()
    assert [each.name for each in first.problem.records] == ["run_3", "run_4"]
    assert first.residual.size == sum(int(each.okay.sum()) for each in apart[:2])
    assert first.jacobian.shape == (first.residual.size, first.x.size)


def test_a_part_and_a_thinned_recording_keep_their_further_outputs() -> None:
    bench = with_output(LOAD_SPEED, *DRY)
    record = bench.records[0]
    part = sliced(record, slice(100, 300))
    np.testing.assert_array_equal(part.channels[0].output, record.channels[0].output[100:300])
    fine = replace(record, sample_time_s=1e-3, time_s=0.1 * record.time_s)
    (thin,) = as_slow_as_needed([fine], bench.model)
    every = round(thin.sample_time_s / fine.sample_time_s)
    assert every > 1
    np.testing.assert_array_equal(thin.channels[0].output, fine.channels[0].output[: thin.output.size * every : every])


def faulty(what: str, record: Record) -> FloatArray:
    speed = record.channels[0].output.copy()
    some = np.arange(speed.size)
    return {
        "it stays at": np.full_like(speed, 3.0),
        "its sign is turned": -speed,
        "the gear's ratio": speed / 5.6,
        "the same signal as the recording's first output": record.output.copy(),
        "good rows hold a reading": np.where(some % 3 == 0, speed, np.nan),
    }[what]


@pytest.mark.parametrize(
    "what",
    [
        "it stays at",
        "its sign is turned",
        "the gear's ratio",
        "the same signal as the recording's first output",
        "good rows hold a reading",
    ],
)
def test_a_channel_that_cannot_be_is_left_out_by_name_and_the_rest_is_used(what: str) -> None:
    bench = with_output(LOAD_SPEED, *DRY)
    record = bench.records[0]
    values = faulty(what, record)
    bad = replace(channel_of(LOAD_SPEED, values, "w2"), okay=np.isfinite(values))
    mended, warnings = with_usable_channels([replace(record, channels=(record.channels[0], bad))])
    assert [channel.label for channel in mended[0].channels] == ["further"]
    (warning,) = warnings
    assert "the output w2 is not used" in warning
    assert what in warning
