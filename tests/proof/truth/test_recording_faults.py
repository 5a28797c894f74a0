"""What happens between the sensor and the file, measured on the recording."""

import numpy as np
import pytest

from hil.proof.truth.case import _sample
from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.recording import (
    CURVATURE_SPEED_RAD_S,
    FAULTLESS,
    FLAG_M1,
    FLAG_M2,
    SPEED_NOISE_RAD_S,
    Acquisition,
    Rows,
    as_recorded,
    sampling_instants_s,
    speed_as_read,
)

N = 3000
TIME_S = np.arange(N) * 0.01


@pytest.fixture
def rng():
    return np.random.default_rng(12)


@pytest.fixture
def rows(rng):
    """Three columns in which no value comes twice."""
    return Rows(rng.normal(100.0, 10.0, N), rng.normal(80.0, 10.0, N), rng.normal(50.0, 5.0, N))


def test_a_faultless_chain_changes_no_row_and_samples_in_time(rows, rng):
    assert as_recorded(rows, FAULTLESS, rng) is rows
    np.testing.assert_array_equal(sampling_instants_s(TIME_S, FAULTLESS, rng), TIME_S)


def test_a_coarse_number_has_its_step_and_no_offset(rng):
    true = np.linspace(10.0, 70.0, N)
    read = speed_as_read(true, Acquisition(grid_rad_s=0.5), rng)
    np.testing.assert_allclose(read / 0.5, np.round(read / 0.5), atol=1e-9)
    assert np.std(read - true) == pytest.approx(np.hypot(0.5 / np.sqrt(12), SPEED_NOISE_RAD_S), rel=0.05)
    assert abs(np.mean(read - true)) < 0.02


def test_counts_of_an_encoder_come_in_whole_ones_and_are_right_on_average(rng):
    true = np.linspace(-30.0, 70.0, N)
    read = speed_as_read(true, Acquisition(count_rad=5e-4, count_time_s=1e-3), rng)
    counts = read * 1e-3 / 5e-4
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert abs(np.mean(read - true)) < 0.02
    assert np.abs(read - true).max() < 0.5 + 6 * SPEED_NOISE_RAD_S


def test_a_curved_sensor_misses_its_share_at_the_stated_speed(rng):
    read = speed_as_read(np.full(N, CURVATURE_SPEED_RAD_S), Acquisition(curvature=0.05), rng)
    assert read.mean() == pytest.approx(0.95 * CURVATURE_SPEED_RAD_S, abs=0.01)
    backwards = speed_as_read(np.full(N, -0.5 * CURVATURE_SPEED_RAD_S), Acquisition(curvature=0.05), rng)
    assert backwards.mean() == pytest.approx(-0.975 * 0.5 * CURVATURE_SPEED_RAD_S, abs=0.01)


def test_a_speed_sampled_late_is_the_speed_of_that_moment(plain, rng):
    """Off-grid sampling is exact: a driveline stopped at each instant anew has the same speeds."""
    torques = 100.0 * rng.choice([-1.0, 1.0], 40)
    instants = np.sort(rng.uniform(0.0, 0.45, 40))  # the last ones after the last torque has begun
    speeds, _, _ = _sample(TruthDriveline(plain, 20.0), torques, 0.5 * torques, instants)
    for instant, speed in list(zip(instants, speeds, strict=True))[::5]:
        fresh, whole = TruthDriveline(plain, 20.0), min(int(instant / 0.01), 39)
        for torque in torques[:whole]:
            fresh.advance((torque, 0.5 * torque), 0.01)
        fresh.advance((torques[whole], 0.5 * torques[whole]), instant - 0.01 * whole)
        assert speed == pytest.approx(fresh.speed_rad_s, abs=1e-4)


def test_stale_speeds_repeat_the_last_good_one_and_leave_the_torques(rows, rng):
    stale = as_recorded(rows, Acquisition(stale_share=0.05, stale_most=3), rng)
    repeated = np.flatnonzero(np.diff(stale.speed_rad_s) == 0.0) + 1
    assert 0.05 * N < repeated.size < 0.15 * N
    kept = np.setdiff1d(np.arange(N), repeated)
    np.testing.assert_array_equal(stale.speed_rad_s[kept], rows.speed_rad_s[kept])
    assert stale.torque_m1_nm is rows.torque_m1_nm
    assert stale.flags is None


def test_lost_samples_are_nan_and_flagged_in_their_row(rows, rng):
    lost = as_recorded(rows, Acquisition(lost_share=0.02, lost_most=10, lost_m2=True, lost_speed=True), rng)
    gone = np.isnan(lost.torque_m2_nm)
    assert 0.05 * N < gone.sum() < 0.2 * N
    np.testing.assert_array_equal(gone, np.isnan(lost.speed_rad_s))
    assert np.isfinite(lost.torque_m1_nm).all()
    np.testing.assert_array_equal(lost.flags, np.where(gone, FLAG_M1 + FLAG_M2, 0))
    only_m2 = as_recorded(rows, Acquisition(lost_share=0.02, lost_m2=True), rng)
    assert set(np.unique(only_m2.flags)) == {0, FLAG_M2}


def test_a_lost_sample_may_be_a_zero_that_nobody_flagged(rows, rng):
    lost = as_recorded(rows, Acquisition(lost_share=0.02, lost_m1=True, lost_as_zero=True), rng)
    assert lost.flags is None
    assert 0.01 * N < np.count_nonzero(lost.torque_m1_nm == 0.0) < 0.03 * N
    assert np.isfinite(lost.torque_m1_nm).all()
