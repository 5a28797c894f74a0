import numpy as np
import pytest

from estimator.identification.linear_model import Orders
from estimator.identification.modes.physical import two_mass_model
from estimator.identification.offline.fits import LinearFit, fit_box_jenkins, fit_noise, free_run
from estimator.identification.offline.linearity import Linearity
from estimator.identification.offline.validation import correlation_test, judge_feedback, residual_tests, validate
from estimator.signals.record import FloatArray, Record
from tests.estimator.identification import driveline
from tests.estimator.identification.closed_loop import controlled

THIRD = Orders(3, 3, 1)


def test_the_right_model_passes_as_often_as_it_should(records: list[Record], fits: list[LinearFit]) -> None:
    """At 95 % each, 3 or more of 6 fail with a probability of 0.2 %."""
    results = [validate(fit, record) for fit, record in zip(fits, records, strict=True)]
    assert sum(not result.independence.is_independent for result in results) <= 2
    assert sum(judge_feedback(result).detected for result in results) <= 1


def test_a_model_of_too_low_an_order_fails(records: list[Record]) -> None:
    result = validate(fit_box_jenkins(records[0], Orders(2, 2, 1)), records[0])
    assert result.independence.p_value < 1e-6
    assert "correlated with the past input" in result.statement
    assert "misses a part of the response" in result.statement


def test_free_run_is_reported_first_and_one_step_as_what_it_is(records: list[Record], fits: list[LinearFit]) -> None:
    result = validate(fits[0], records[0], records[1:3])
    assert result.own.fit_percent == pytest.approx(fits[0].fit_percent, abs=0.1)
    assert [run.name for run in result.unseen] == ["run_301", "run_302"]
    assert all(75 < run.fit_percent < run.one_step_fit_percent for run in result.unseen)
    assert result.statement.startswith("Free-run fit")
    assert result.statement.index("unseen") < result.statement.index("one step ahead")


def test_a_controller_that_answers_the_speed_is_detected_and_its_effects_reported() -> None:
    record, _ = controlled(1, gain=200.0)
    found = judge_feedback(validate(fit_box_jenkins(record, THIRD), record))
    assert found.detected
    assert "The torque follows the speed" in found.statement
    assert "Use the Box-Jenkins model" in found.statement


def residual_and_input(gain: float, seed: int) -> tuple[FloatArray, Record]:
    """Return what the true drive leaves of a recording under control, and the recording."""
    record, _ = controlled(seed, gain)
    truth = two_mass_model(np.array([driveline.J_M, driveline.J_L, driveline.K, driveline.C, 0.35, 0.9]), 0.01)
    return free_run(truth, record, fit_noise(record.output, record.okay, 20)).error, record


def test_a_driver_far_weaker_than_the_prbs_is_found_between_its_jumps() -> None:
    for seed in range(3):
        assert residual_tests(*residual_and_input(40.0, seed), 1)[1].p_value < 1e-6
    open_loop = [residual_tests(*residual_and_input(0.0, seed), 1)[1].p_value for seed in range(6)]
    assert sum(p < 0.01 for p in open_loop) <= 1  # two of six: 0.0015


def test_a_departure_that_does_not_matter_is_none_however_long_the_recording() -> None:
    n, lags = 1_000_000, np.arange(1, 26)
    rng = np.random.default_rng(3)
    x, okay = rng.normal(size=n), np.ones(n, dtype=bool)
    small = correlation_test(rng.normal(size=n) + 0.01 * np.roll(x, 3), x, okay, lags)
    assert small.p_value < 1e-6
    assert small.is_independent
    assert not correlation_test(rng.normal(size=n) + 0.1 * np.roll(x, 3), x, okay, lags).is_independent
    assert Linearity(1e-30, 1e-30, 0.5, effect=0.01).is_linear
    assert not Linearity(1e-30, 1e-30, 0.5, effect=0.2).is_linear
