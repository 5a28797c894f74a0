"""The acquisition chain: faults out before the fits, back in where simulations are held against recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import replay, with_faults_compensated, without_acquisition_effects
from estimator.diagnosis.inference.hypotheses import NOTHING, all_good_samples
from estimator.physics.catalogue import EFFECTS
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel, EffectValue, Parameter, Structure
from estimator.signals.record import Record
from tests.estimator.diagnosis.acquisition.bench import NOISE, SAMPLES, Line, drives, periodic_rows, random_rows, stale
from tests.estimator.diagnosis.plain import Bench

EVERY = 7
STALE = periodic_rows(EVERY)
LOST = random_rows(np.random.default_rng(3), 0.06, burst=2.0)


def line_of(line: Line, effects: Mapping[str, Mapping[str, float]] | None = None) -> DrivelineModel:
    """The driveline as a model that is trusted to a fifth."""
    values = {"J_M": line.j_m, "J_L": line.j_l, "k": line.k, "c": line.c, "b_M": line.b_m, "b_L": line.b_l}
    return DrivelineModel(
        Structure.TWO_MASS,
        {name: Parameter(value, 0.2) for name, value in values.items()},
        effects={name: {key: EffectValue(v) for key, v in each.items()} for name, each in (effects or {}).items()},
    )


TRUTH = drives(1)[0]
HEALTHY = TRUTH.record("cruise")
MODEL = line_of(TRUTH.line)


def with_stale_speed() -> Record:
    return stale(HEALTHY, STALE, (0,))


class TestHealthy:
    def test_nothing_is_found_and_nothing_changed(self) -> None:
        chain = with_faults_compensated([HEALTHY])
        assert chain.findings == ()
        assert chain.effects() == {}
        assert chain.records[0] is chain.raw[0] is HEALTHY


class TestStale:
    def test_it_is_masked_for_fits_and_kept_as_read(self) -> None:
        read = with_stale_speed()
        chain = with_faults_compensated([read])
        assert [finding.name for finding in chain.findings] == ["stale_samples"]
        assert not chain.records[0].okay[STALE].any()
        assert chain.raw[0].okay.all()
        assert chain.effects()["stale_samples"]["share"] == pytest.approx(1.0 / EVERY, rel=0.01)

    def test_errors_are_those_of_the_simulation_as_this_chain_would_have_read_it(self) -> None:
        """Where the recording repeats, so does the simulation: what is left is the noise, in every row."""
        read, true = with_stale_speed(), TRUTH.speed()
        (errors,) = with_faults_compensated([read]).errors([true])
        renewed = np.maximum.accumulate(np.where(STALE, 0, np.arange(SAMPLES)))
        np.testing.assert_allclose(errors, true[renewed] - read.output)
        assert np.std(errors) == pytest.approx(NOISE, rel=0.05)
        assert np.std(true - read.output) > 2.0 * NOISE


class TestLostZeros:
    """The speed was recorded as zero where it was not read."""

    READ = replace(HEALTHY, output=np.where(LOST, 0.0, HEALTHY.output))

    def test_they_are_no_errors(self) -> None:
        true = TRUTH.speed()
        (errors,) = with_faults_compensated([self.READ]).errors([true])
        np.testing.assert_allclose(errors, (true - HEALTHY.output)[~LOST])


class TestHiddenJitter:
    def jittered(self) -> Record:
        return TRUTH.record("cruise", speed=TRUTH.speed(1.5e-3 * np.random.default_rng(4).standard_normal(SAMPLES)))

    def test_it_is_found_in_the_errors_of_a_converged_fit(self) -> None:
        records = [self.jittered()]
        chain, result = with_faults_compensated(records), Bench(MODEL, records, all_good_samples(records)).fit(NOTHING)
        found = chain.with_jitter_in(result)
        assert [finding.name for finding in found.findings] == ["sample_jitter"]
        assert found.effects()["sample_jitter"]["jitter_s"] == pytest.approx(1.5e-3, rel=0.1)
        assert found.with_jitter_in(result) is found
        excess = float(np.sum((result.outputs[0] - records[0].output) ** 2)) - SAMPLES * NOISE**2
        assert found.added_squares(result) == [pytest.approx(excess, rel=0.25)]  # though it cannot be undone

    def test_what_it_adds_in_the_mean_is_taken_off(self) -> None:
        """Where the torque steps, readings are off to one side, come they early or late: the line seems heavier."""
        heavier = []
        for seed in range(4):
            offset_s = 2.2e-3 * np.random.default_rng(seed).standard_normal(SAMPLES)
            records = [TRUTH.record("cruise", speed=TRUTH.speed(offset_s))]
            as_read = Bench(MODEL, records, all_good_samples(records)).fit(NOTHING)
            steady = with_faults_compensated(records).with_jitter_in(as_read).records
            without = Bench(MODEL, steady, all_good_samples(steady)).fit(NOTHING, as_read)
            heavier.append([fit.p[slot("", "J_M")] / TRUTH.line.j_m - 1.0 for fit in (as_read, without)])
        before, after = np.mean(heavier, axis=0)
        assert before > 0.008
        assert abs(after) < 0.4 * before


class TestRounded:
    """A reading in steps of four times its noise: known of, and not to be undone."""

    STEP = 4.0 * NOISE
    READ = replace(HEALTHY, output=STEP * np.round(HEALTHY.output / STEP))

    def test_it_adds_what_rounding_adds(self) -> None:
        chain = with_faults_compensated([self.READ])
        assert [finding.name for finding in chain.findings] == ["speed_quantisation"]
        result = Bench(MODEL, [self.READ], all_good_samples([self.READ])).fit(NOTHING)
        assert chain.added_squares(result) == [pytest.approx(SAMPLES * self.STEP**2 / 12.0, rel=1e-6)]

    def test_the_reading_in_the_mean_is_nearer_than_the_speed_and_than_its_step(self) -> None:
        true = TRUTH.speed()
        (errors,) = with_faults_compensated([self.READ]).errors([true])
        stepped = self.STEP * np.round(true / self.STEP)
        assert np.std(errors) < 0.99 * np.std(true - self.READ.output)
        assert np.std(errors) < 0.95 * np.std(stepped - self.READ.output)


class TestReplay:
    """A model on a recording, as the acquisition that the model describes would have read it."""

    def test_repeats_are_repeated(self) -> None:
        read = with_stale_speed()
        run = replay(line_of(TRUTH.line, {"stale_samples": {"share": 1.0 / EVERY}}), read)
        np.testing.assert_array_equal(run.output[STALE], run.output[np.flatnonzero(STALE) - 1])
        assert run.rms == pytest.approx(NOISE, rel=0.05)
        assert replay(MODEL, read).rms > 2.0 * NOISE

    def test_what_the_recording_has_and_the_model_has_not_stays_an_error(self) -> None:
        """The model says rounded, the recording repeats as well: nobody compensated that."""
        quantised = line_of(TRUTH.line, {"speed_quantisation": {"step_rad_s": 1e-6}})
        assert replay(quantised, with_stale_speed()).rms > 2.0 * NOISE


class TestMechanical:
    def test_what_is_recognised_in_recordings_is_taken_out_and_nothing_else(self) -> None:
        mechanics = {"backlash": {"gap_rad": 0.02}, "clock_drift": {"rate": 1e-4}}
        recognised = {name: {entry.parameters[0].name: 0.1} for name, entry in EFFECTS.items() if entry.recognised}
        whole = line_of(TRUTH.line, mechanics | recognised)
        assert set(recognised) == {"speed_quantisation", "stale_samples", "lost_samples", "sample_jitter"}
        assert without_acquisition_effects(whole) == line_of(TRUTH.line, mechanics)
