"""Every spectral estimator against the exact response: one result type, intervals that hold, what each is for."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from estimator.errors import BadSetting, NotExciting
from estimator.identification.linear_model import LinearModel
from estimator.identification.spectral import SpectralEstimate, good_segments, spectral_estimate
from estimator.signals.decimate import decimate
from estimator.signals.record import FloatArray, Record
from tests.benchmarks.identification.local_polynomial import local_polynomial
from tests.estimator.identification.closed_loop import response
from tests.estimator.identification.driveline import cruise

MODEL = LinearModel(a=(-1.0, 0.6), b=(0.5, 0.2), nk=1, sample_time_s=0.02)


def record(n: int, noise: float, seed: int = 0) -> Record:
    rng = np.random.default_rng(seed)
    u = rng.normal(size=n)
    y = MODEL.simulate(u) + noise * rng.normal(size=n)
    return Record("made", 0.02, 0.02 * np.arange(n), u[:, np.newaxis], y, np.ones(n, dtype=bool))


def masked(source: Record, bad: FloatArray) -> Record:
    okay = np.ones(source.output.shape, dtype=bool)
    okay[bad.astype(int)] = False
    output = np.where(okay, source.output, np.nan)
    return Record(source.name, 0.02, source.time_s, source.torque_nm, output, okay)


def test_equals_scipys_welch_estimate() -> None:
    source = record(4000, noise=0.3)
    u, y = source.total_torque_nm, source.output
    ours = spectral_estimate(source, 256)
    setting = {"fs": 50.0, "window": "hann", "nperseg": 256, "noverlap": 128}
    frequency_hz, s_uy = scipy.signal.csd(u, y, **setting)
    s_uu = scipy.signal.welch(u, **setting)[1]
    np.testing.assert_allclose(ours.frequency_hz, frequency_hz[1:])
    np.testing.assert_allclose(ours.response, (s_uy / s_uu)[1:], rtol=1e-9)
    np.testing.assert_allclose(ours.coherence, scipy.signal.coherence(u, y, **setting)[1][1:], rtol=1e-9)


def test_the_truth_lies_within_the_stated_error() -> None:
    deviations = []
    for seed in range(40):
        estimate = spectral_estimate(record(4096, noise=0.5, seed=seed), 256)
        truth = np.abs(MODEL.response(estimate.frequency_hz))
        deviations.append((np.abs(estimate.response) - truth) / estimate.magnitude_std)
    inner = np.array(deviations)[:, 4:-4]
    assert 0.85 < inner.std() < 1.15  # in units of the stated standard deviation
    assert np.mean(np.abs(inner) > 1.96) == pytest.approx(0.05, abs=0.03)


def test_segments_with_a_masked_sample_are_left_out() -> None:
    okay = np.ones(100, dtype=bool)
    okay[45] = False
    assert good_segments(okay, 20) == [0, 10, 20, 50, 60, 70, 80]
    source = record(4000, noise=0.0)
    estimate = spectral_estimate(masked(source, np.array([1000, 3000])), 256)
    assert np.isfinite(estimate.response).all()
    assert estimate.coherence[5:-5].min() > 0.99


def test_an_input_without_power_has_no_coherence_and_infinite_error() -> None:
    n = 2000
    quiet = Record(
        "quiet", 0.02, 0.02 * np.arange(n), np.zeros((n, 1)), np.random.default_rng(0).normal(size=n), np.ones(n, bool)
    )
    estimate = spectral_estimate(quiet)
    assert not estimate.coherence.any()
    assert np.isinf(estimate.magnitude_std).all()


def test_too_few_unbroken_segments_are_refused() -> None:
    source = record(400, noise=0.1)
    okay = np.arange(400) % 40 > 10  # gaps of 0.22 s, and 0.58 s between them
    with pytest.raises(NotExciting, match=r"0 unbroken segments of 1\.28 s, expected 3 or more") as refusal:
        spectral_estimate(replace(source, okay=okay), 256)
    assert refusal.value.names == ("frequency response",)


def test_a_segment_too_short_is_refused() -> None:
    with pytest.raises(BadSetting, match="segment_samples is 7"):
        spectral_estimate(record(400, noise=0.1), 7)


PERIOD = 1023
METHODS: dict[str, Callable[[Record], SpectralEstimate]] = {
    "welch": lambda record: spectral_estimate(record, 512),
    "local_polynomial": local_polynomial,
}
each = pytest.mark.parametrize("method", METHODS)


@pytest.fixture(scope="module")
def records() -> list[Record]:
    return [decimate(cruise(seed, 42.0).record, 1) for seed in range(8)]


def around(estimate: SpectralEstimate, low_hz: float, high_hz: float) -> np.ndarray:
    return (estimate.frequency_hz > low_hz) & (estimate.frequency_hz < high_hz)


@each
def test_intervals_hold_the_exact_response(method: str, records: list[Record]) -> None:
    held = []
    for record in records:
        estimate = METHODS[method](record)
        band = around(estimate, 3.0, 20.0)
        found, reach = np.abs(estimate.response[band]), 1.96 * estimate.magnitude_std[band]
        held.append(np.mean(np.abs(response(estimate.frequency_hz[band]) - found) <= reach))
        assert ((estimate.coherence >= 0) & (estimate.coherence <= 1)).all()
        assert (estimate.magnitude_std > 0).all()
    assert np.mean(held) == pytest.approx(0.95, abs=0.06)


def test_without_leakage_the_peak_is_not_blurred(records: list[Record]) -> None:
    def worst_db(estimate: SpectralEstimate) -> float:
        band = around(estimate, 7.5, 9.0)
        ratio = np.abs(estimate.response[band]) / response(estimate.frequency_hz[band])
        return float(np.abs(20 * np.log10(ratio)).max())

    for record in records[:4]:
        assert worst_db(local_polynomial(record)) < 0.4 < worst_db(spectral_estimate(record, 256))


@each
def test_noise_alone_has_no_coherence(method: str) -> None:
    rng, n = np.random.default_rng(0), 4 * PERIOD
    u = np.tile(rng.normal(size=PERIOD), 4)
    record = Record("noise", 0.01, 0.01 * np.arange(n), u[:, np.newaxis], rng.normal(size=n), np.ones(n, dtype=bool))
    assert METHODS[method](record).coherence.mean() < 0.4
    response_only = Record(
        "clean", 0.01, record.time_s, record.torque_nm, scipy.signal.lfilter([0, 1.0], [1, -0.9], u), record.okay
    )
    assert METHODS[method](response_only).coherence.mean() > 0.97


def with_gaps(record: Record, bad: slice) -> Record:
    okay = record.okay.copy()
    okay[bad] = False
    output = np.where(okay, record.output, np.nan)
    return Record("gaps", record.sample_time_s, record.time_s, record.torque_nm, output, okay)


@each
def test_masked_samples_are_not_looked_at(method: str, records: list[Record]) -> None:
    estimate = METHODS[method](with_gaps(records[0], slice(1100, 1150)))
    assert np.isfinite(estimate.response).all()
    band = around(estimate, 4.0, 7.0)
    np.testing.assert_allclose(np.abs(estimate.response[band]), response(estimate.frequency_hz[band]), rtol=0.4)


def test_the_transient_is_reported_from_the_response() -> None:
    """From a swing that is as large as all that the input does, without noise: no window distinguishes the two."""
    rng, n = np.random.default_rng(3), 1000
    u = rng.normal(size=n)
    a, b = [1.0, -1.78, 0.95 * 0.95], [0.0, 0.02, 0.01]
    forced, free = scipy.signal.lfilter(b, a, u), scipy.signal.lfilter([1.0], a, np.eye(1, n)[0])
    y = forced + free * np.abs(forced).max() / np.abs(free).max()
    record = Record("swing", 0.02, 0.02 * np.arange(n), u[:, np.newaxis], y, np.ones(n, dtype=bool))

    def typical(estimate: SpectralEstimate) -> float:
        _, truth = scipy.signal.freqz(b, a, 2 * np.pi * estimate.frequency_hz * 0.02)
        return float(np.median(np.abs(estimate.response / truth - 1.0)[around(estimate, 1.5, 6.0)]))

    assert typical(local_polynomial(record)) < 0.02
    assert typical(spectral_estimate(record, 256)) > 3 * typical(local_polynomial(record))


@pytest.mark.parametrize(
    ("estimate", "named"),
    [
        (lambda record: local_polynomial(record, 2), "half_width is 2"),
        (lambda record: local_polynomial(record, 6, -1), "degree is -1"),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    records: list[Record], estimate: Callable[[Record], SpectralEstimate], named: str
) -> None:
    with pytest.raises(BadSetting, match=named):
        estimate(records[0])


@pytest.mark.parametrize(
    ("estimate", "why"), [(lambda record: local_polynomial(with_gaps(record, slice(None, -20))), "lines, expected 13")]
)
def test_too_little_data_are_refused(
    records: list[Record], estimate: Callable[[Record], SpectralEstimate], why: str
) -> None:
    with pytest.raises(NotExciting, match=why) as refusal:
        estimate(records[0])
    assert refusal.value.names == ("frequency response",)
