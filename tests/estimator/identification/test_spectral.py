"""The frequency response without a model, against the exact one: intervals that hold, no blurred peak, distortion."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from estimator.errors import NotExciting
from estimator.identification.spectral import SpectralEstimate, spectral_estimate
from estimator.signals.decimate import decimate
from estimator.signals.multisine import Lines, excited_lines, multisine_nm
from estimator.signals.record import FloatArray, Record
from tests.estimator.identification.closed_loop import response
from tests.estimator.identification.driveline import cruise

T = 0.01
PERIOD = 1000
A, B = [1.0, -1.78, 0.95 * 0.95], [0.0, 0.02, 0.01]


def recorded(u: FloatArray, y: FloatArray, okay: np.ndarray | None = None) -> Record:
    okay = np.ones(u.size, dtype=bool) if okay is None else okay
    return Record("made", T, T * np.arange(u.size), u[:, np.newaxis], np.where(okay, y, np.nan), okay)


def multisine(periods: int) -> FloatArray:
    lines = excited_lines(PERIOD, T, 1.0, 30.0, Lines.ODD_RANDOM, 1)
    return np.tile(multisine_nm(PERIOD, lines, 60.0), periods)


@pytest.fixture(scope="module")
def records() -> list[Record]:
    return [decimate(cruise(seed, 42.0).record, 1) for seed in range(8)]


def around(estimate: SpectralEstimate, low_hz: float, high_hz: float) -> np.ndarray:
    return (estimate.frequency_hz > low_hz) & (estimate.frequency_hz < high_hz)


def held(estimate: SpectralEstimate, truth: FloatArray, band: np.ndarray) -> float:
    """Share of the band in which the 95 % interval holds the truth."""
    return float(np.mean(np.abs(truth - np.abs(estimate.response))[band] <= 1.96 * estimate.magnitude_std[band]))


def test_intervals_hold_the_exact_response_and_the_peak_is_not_blurred(records: list[Record]) -> None:
    """A PRBS on a road whose load varies; 100 lines of other drivelines: `tests.benchmarks.identification`."""
    shares = []
    for record in records:
        estimate = spectral_estimate(record)
        truth = response(estimate.frequency_hz)
        shares.append(held(estimate, truth, around(estimate, 3.0, 20.0)))
        peak = around(estimate, 7.5, 9.0)
        assert np.abs(20 * np.log10(np.abs(estimate.response) / truth))[peak].max() < 0.4
        assert estimate.distortion is None
    assert np.mean(shares) == pytest.approx(0.95, abs=0.03)


def test_noise_alone_has_no_coherence_and_a_response_alone_has_all() -> None:
    rng = np.random.default_rng(0)
    u = rng.normal(size=4000)
    assert spectral_estimate(recorded(u, rng.normal(size=u.size))).coherence.mean() < 0.4
    assert spectral_estimate(recorded(u, scipy.signal.lfilter(B, A, u))).coherence.mean() > 0.97


def test_an_input_without_power_has_no_coherence_and_infinite_error() -> None:
    estimate = spectral_estimate(recorded(np.zeros(2000), np.random.default_rng(0).normal(size=2000)))
    assert not estimate.coherence.any()
    assert np.isinf(estimate.magnitude_std).all()


def test_the_transient_is_distinguished_from_the_response() -> None:
    """From a swing that is as large as all that the input does, without noise: no window distinguishes the two."""
    u = np.random.default_rng(3).normal(size=1000)
    forced, free = scipy.signal.lfilter(B, A, u), scipy.signal.lfilter([1.0], A, np.eye(1, 1000)[0])
    estimate = spectral_estimate(recorded(u, forced + free * np.abs(forced).max() / np.abs(free).max()))
    _, truth = scipy.signal.freqz(B, A, 2 * np.pi * estimate.frequency_hz * T)
    assert np.median(np.abs(estimate.response / truth - 1.0)[around(estimate, 3.0, 12.0)]) < 0.02


def test_stretches_between_long_gaps_are_averaged_and_short_gaps_bridged(records: list[Record]) -> None:
    whole = records[0]
    okay = whole.okay.copy()
    okay[1500:1600] = okay[3000] = False
    estimate = spectral_estimate(replace(whole, okay=okay, output=np.where(okay, whole.output, np.nan)))
    band = around(estimate, 4.0, 15.0)
    np.testing.assert_allclose(np.abs(estimate.response[band]), response(estimate.frequency_hz[band]), rtol=0.3)
    assert estimate.bridged_samples == 1
    assert estimate.used_samples == okay.sum() + 1


def test_a_prbs_on_steps_to_and_fro_is_not_taken_for_periodic(records: list[Record]) -> None:
    """The steps repeat themselves; what excites the resonance does not."""
    whole = records[0]
    step_nm = 1000.0 * (np.arange(whole.okay.size) // 200 % 2)
    estimate = spectral_estimate(replace(whole, torque_nm=whole.torque_nm + step_nm[:, np.newaxis]))
    assert around(estimate, 5.0, 12.0).sum() > 10
    assert estimate.distortion is None


def test_a_short_slow_recording_of_a_short_period_has_an_estimate() -> None:
    """26 samples hold no four periods of 32."""
    u = np.resize([1.0, -1.0, 0.5, -0.5, 0.2], 30)
    record = replace(recorded(u, scipy.signal.lfilter(B, A, u)), sample_time_s=0.1, time_s=0.1 * np.arange(30))
    assert np.isfinite(spectral_estimate(record).response).all()


def test_a_torque_that_rests_after_its_beginning_repeats_nothing(records: list[Record]) -> None:
    whole = records[0]
    torque_nm = np.where(np.arange(whole.okay.size)[:, np.newaxis] < whole.okay.size // 8, whole.torque_nm, 0.0)
    estimate = spectral_estimate(replace(whole, torque_nm=torque_nm))
    assert np.isfinite(estimate.response).all()
    assert estimate.distortion is None


def test_too_short_stretches_are_refused(records: list[Record]) -> None:
    okay = np.arange(records[0].okay.size) % 40 > 10  # gaps of 0.11 s, and 0.29 s between them
    with pytest.raises(NotExciting, match="no unbroken stretch of 2 s") as refusal:
        spectral_estimate(replace(records[0], okay=okay))
    assert refusal.value.names == ("frequency response",)


def test_the_mean_over_the_periods_of_a_multisine_is_at_its_lines_alone() -> None:
    rng = np.random.default_rng(1)
    u = multisine(6)
    linear = scipy.signal.lfilter(B, A, u)
    shares = []
    for _ in range(20):
        estimate = spectral_estimate(recorded(u, linear + rng.normal(0.0, 0.5, u.size)))
        _, truth = scipy.signal.freqz(B, A, 2 * np.pi * estimate.frequency_hz * T)
        shares.append(held(estimate, np.abs(truth), around(estimate, 1.0, 30.0)))
    assert (estimate.frequency_hz * T * PERIOD % 2).round(6) == pytest.approx(1.0)
    assert estimate.n_averages == 5.0
    assert np.mean(shares) == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize(("power", "even"), [(2, True), (3, False)])
def test_distortion_is_found_at_lines_without_torque_and_named_by_its_parity(power: int, even: bool) -> None:
    """``y + a (u / 60)^n``: of a square the even lines know, of a cube the odd ones, of noise neither."""
    rng = np.random.default_rng(2)
    u = multisine(6)
    noisy = scipy.signal.lfilter(B, A, u) + rng.normal(0.0, 0.2, u.size)
    clean = spectral_estimate(recorded(u, noisy)).distortion
    assert clean is not None
    assert min(clean.level(even)[1], clean.level(not even)[1]) > 0.01
    distorted = spectral_estimate(recorded(u, noisy + 0.5 * (u / 60.0) ** power)).distortion
    assert distorted is not None
    level, p_value = distorted.level(even)
    assert p_value < 1e-6
    spectrum = 2.0 / PERIOD * np.abs(np.fft.rfft(0.5 * (u[:PERIOD] / 60.0) ** power))
    lines = np.rint(distorted.frequency_hz[distorted.is_even == even] * T * PERIOD).astype(int)
    assert level == pytest.approx(np.sqrt(np.mean(spectrum[lines] ** 2)), rel=0.15)
    assert distorted.level(not even)[1] > 0.01
