"""Every off-line estimator on the same cruises: one contract, and what sets them apart."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimator.errors import BadSetting, NotExciting
from estimator.identification.linear_model import Orders
from estimator.identification.modes.modes import UncertainMode
from estimator.identification.offline.fits import LinearFit, Method, fit_box_jenkins, fit_output_error
from estimator.signals.decimate import MOST_BLOCKS, block_of, decimate, first_part, high_passed
from estimator.signals.record import Record
from tests.benchmarks.buses import draw_bus, drive
from tests.estimator.identification.closed_loop import controlled
from tests.estimator.identification.driveline import cruise, true_resonance, uncertain_resonance

Fit = Callable[..., LinearFit]
METHODS: dict[Method, Fit] = {Method.OUTPUT_ERROR: fit_output_error, Method.BOX_JENKINS: fit_box_jenkins}
THIRD = Orders(3, 3, 1)
FREQUENCY_HZ, DAMPING = true_resonance()
each = pytest.mark.parametrize(("method", "fit"), METHODS.items(), ids=[method.value for method in METHODS])


@pytest.fixture(scope="module")
def record() -> Record:
    return decimate(cruise(50, 20.0).record, 1)


def mode_of(fit: LinearFit) -> UncertainMode:
    mode = uncertain_resonance(fit.model, fit.covariance)
    assert mode is not None
    return mode


@each
def test_one_contract(method: Method, fit: Fit, record: Record) -> None:
    before = (record.torque_nm.copy(), record.output.copy())
    found = fit(record, THIRD)
    assert found.method is method
    assert found.model.is_stable
    assert found.model.orders == THIRD
    assert found.covariance.shape == (6, 6)
    assert (np.linalg.eigvalsh(found.covariance) > -1e-15).all()
    error = record.output - found.simulate(record.total_torque_nm)
    assert np.sqrt(np.mean(error[found.first :][record.okay[found.first :]] ** 2)) == pytest.approx(found.rms)
    assert found.fit_percent < found.one_step_fit_percent
    for array, copy in zip((record.torque_nm, record.output), before, strict=True):
        assert np.array_equal(array, copy)


@each
def test_masked_outputs_are_not_looked_at(method: Method, fit: Fit, record: Record) -> None:
    okay = record.okay.copy()
    okay[700:760] = okay[1500:1520] = False
    found = fit(replace(record, output=np.where(okay, record.output, np.nan), okay=okay), THIRD)
    assert mode_of(found).frequency_hz.value == pytest.approx(FREQUENCY_HZ, rel=0.02)
    assert found.n_samples <= np.count_nonzero(okay)


@each
def test_without_noise_all_find_the_truth(method: Method, fit: Fit, record: Record) -> None:
    rng = np.random.default_rng(0)
    made = fit(record, THIRD).model
    u = rng.normal(size=1500)
    clean = Record("clean", 0.01, 0.01 * np.arange(1500), u[:, np.newaxis], made.simulate(u), np.ones(1500, dtype=bool))
    np.testing.assert_allclose(fit(clean, THIRD).model.theta, made.theta, rtol=1e-4, atol=1e-9)


def test_the_damping_is_unbiased() -> None:
    errors = {method: [] for method in METHODS}
    for seed in range(60, 64):
        record = decimate(cruise(seed, 15.0).record, 1)
        for method, fit in METHODS.items():
            errors[method].append(mode_of(fit(record, THIRD)).damping.value / DAMPING - 1.0)
    bias = {method: abs(np.mean(values)) for method, values in errors.items()}
    assert max(bias.values()) < 0.01


@pytest.mark.campaign
@pytest.mark.parametrize("buses", [4, pytest.param(12, marks=pytest.mark.campaign)])
def test_the_noise_model_makes_more_of_the_same_data(buses: int) -> None:
    """On a road, with a driver, in frequency; every dozen of the benchmark's 200 buses has a ratio below 0.5."""
    errors: dict[Method, list[float]] = {Method.OUTPUT_ERROR: [], Method.BOX_JENKINS: []}
    for seed in range(60, 60 + buses):
        bus = draw_bus(seed)
        record, (frequency_hz, _) = high_passed(drive(bus)), bus.line.resonance()
        for method, values in errors.items():
            values.append(mode_of(METHODS[method](record, THIRD)).frequency_hz.value / frequency_hz - 1.0)
    scatter = {method: np.sqrt(np.mean(np.square(values))) for method, values in errors.items()}
    assert scatter[Method.BOX_JENKINS] < 0.7 * scatter[Method.OUTPUT_ERROR]


def test_in_closed_loop_the_noise_model_keeps_the_truth() -> None:
    """Sensor noise comes back through the torque."""
    for seed in (1, 2):
        record, _ = controlled(seed, gain=200.0)
        mode = mode_of(fit_box_jenkins(record, THIRD))
        assert mode.frequency_hz.value == pytest.approx(FREQUENCY_HZ, rel=0.005)
        assert mode.damping.value == pytest.approx(DAMPING, rel=0.05)


def broken(record: Record, **changes: object) -> Record:
    return replace(record, **changes)  # type: ignore[arg-type]  # of a field's type


@each
def test_what_can_not_be_determined_is_refused_by_name(method: Method, fit: Fit, record: Record) -> None:
    n = record.output.shape[0]
    sine = 60.0 * np.sin(2 * np.pi * 5.0 * record.time_s)[:, np.newaxis]
    short = slice(0, 50)
    for made, why, names in (
        (broken(record, torque_nm=np.full((n, 1), 300.0)), "determined. Let the torque vary", THIRD.names[1:3]),
        (broken(record, torque_nm=sine), "the torque excites 2 parameters, expected 6", THIRD.names[1:3]),
        (broken(record, output=np.full(n, 120.0)), "the measured output never changes", THIRD.names),
        (
            Record(
                "short", 0.01, record.time_s[short], record.torque_nm[short], record.output[short], record.okay[short]
            ),
            "50 good samples, expected at least 60",
            THIRD.names,
        ),
    ):
        with pytest.raises(NotExciting, match=why) as refusal:
            fit(made, THIRD)
        assert set(names) <= set(refusal.value.names)


@each
def test_a_period_that_is_not_that_of_the_time_stamps_is_refused(method: Method, fit: Fit, record: Record) -> None:
    with pytest.raises(BadSetting, match=r"time stamps are 0\.01 s apart.*wrong by 2"):
        fit(replace(record, sample_time_s=0.005), THIRD)


@pytest.mark.parametrize("sample_time_s", [0.001, 0.01, 0.02])
def test_of_a_long_recording_the_first_part_is_taken(sample_time_s: float) -> None:
    most = MOST_BLOCKS * block_of(sample_time_s)
    n = most + 1000
    time_s = sample_time_s * np.arange(n)
    record = Record("long", sample_time_s, time_s, np.ones((n, 1)), time_s, np.ones(n, dtype=bool))
    part = first_part(record)
    assert part.time_s.shape == part.output.shape == part.okay.shape == (most,)
    assert np.array_equal(part.output, record.output[:most])
    assert first_part(part) is part
