"""The band of a mismatch, and when a band that was reported is right."""

import numpy as np
import pytest

from hil.proof.mismatch.band import CENTRAL, Spectrum, compare, spectrum_of
from hil.proof.truth.experiments import PERIOD_S, SAMPLES

TIME_S = PERIOD_S * np.arange(SAMPLES)
FLAT = Spectrum(np.arange(0.0, 50.5, 0.5), np.ones(101))


def test_a_pure_tone_is_in_a_band_around_it():
    spectrum = spectrum_of([np.sin(2.0 * np.pi * 7.0 * TIME_S)])
    low, high = spectrum.band_hz()
    assert low <= 7.0 <= high
    assert high - low <= 2.0 * spectrum.step_hz
    assert spectrum.share_in((low, high)) >= CENTRAL


def test_white_noise_is_in_the_central_part_of_all_there_is():
    noise = np.random.default_rng(2).normal(size=(3, SAMPLES))
    assert spectrum_of(list(noise)).band_hz() == pytest.approx((5.0, 45.0), abs=1.5)


def test_each_recording_counts_by_its_power():
    slow, fast = np.sin(2.0 * np.pi * 2.0 * TIME_S), np.sin(2.0 * np.pi * 20.0 * TIME_S)
    low, high = spectrum_of([slow, 4.0 * fast]).band_hz()
    assert low > 19.0  # 16/17 of the power is in the other recording
    low, high = spectrum_of([slow, fast]).band_hz()
    assert low < 2.5
    assert high > 19.5


def test_the_true_band_is_right():
    score = compare(FLAT.band_hz(), FLAT)
    assert score.right
    assert score.power_share == pytest.approx(CENTRAL, abs=0.02)
    assert (score.width_ratio, score.overlap) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("said", "right"),
    [((0.0, 50.0), True), ((5.0, 25.0), False), ((5.0, 30.0), True), ((0.0, 20.0), False), ((30.0, 50.0), False)],
    ids=["everything", "less than half", "more than half", "below", "above"],
)
def test_of_an_even_mismatch_most_must_be_reported(said, right):
    assert compare(said, FLAT).right is right


@pytest.mark.parametrize(
    ("said", "right"),
    [((10.0, 14.0), True), ((7.5, 16.5), False), ((12.0, 16.0), True), ((13.0, 17.0), False), ((0.0, 50.0), False)],
    ids=["true", "more than twice as wide", "moved by half", "moved by more", "everything"],
)
def test_of_a_narrow_mismatch_nothing_wide_wins(said, right):
    inside = (FLAT.frequency_hz >= 10.0) & (FLAT.frequency_hz <= 14.0)
    narrow = Spectrum(FLAT.frequency_hz, inside.astype(float))
    assert narrow.band_hz() == (10.0, 14.0)
    assert compare(said, narrow).right is right


def test_a_single_frequency_has_a_width_and_can_be_met():
    line = Spectrum(FLAT.frequency_hz, (FLAT.frequency_hz == 8.0).astype(float))
    assert compare((8.0, 8.0), line).right
    assert compare((8.0, 8.5), line).width_ratio == pytest.approx(2.0)
    assert not compare((9.0, 9.0), line).right
    assert compare((9.0, 9.0), line).overlap == 0.0
