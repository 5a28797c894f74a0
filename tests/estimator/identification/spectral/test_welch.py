from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from estimator.errors import BadSetting, NotExciting
from estimator.identification.linear_model import LinearModel
from estimator.identification.spectral import good_segments, spectral_estimate
from estimator.signals.record import FloatArray, Record

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


def test_coherence_tells_noise_from_response() -> None:
    assert spectral_estimate(record(8192, noise=0.0)).coherence[5:-5].min() > 0.99
    assert spectral_estimate(record(8192, noise=1e3)).coherence.mean() < 0.1


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
        "quiet",
        0.02,
        0.02 * np.arange(n),
        np.zeros((n, 1)),
        np.random.default_rng(0).normal(size=n),
        np.ones(n, bool),
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
