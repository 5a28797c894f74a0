"""What is left of recordings when the bus is re-tuned: nothing of another bus, (I - P) Delta of a small effect."""

from dataclasses import replace

import numpy as np
import pytest

from hil.proof.mismatch.line import line_of, scaled
from hil.proof.mismatch.rest import Heard, heard, retuned_rest_rad_s, true_rest_rad_s
from hil.proof.power.drive import drive, under_torques_of
from hil.proof.power.nuisance import orthonormal, sensitivities, without
from hil.proof.power.sizes import imposed
from hil.proof.truth.bus import NOMINAL_TOLERANCE
from hil.proof.truth.case import TESTS, record
from hil.proof.truth.sensors import SILENT, SPEED_NOISE_RAD_S
from hil.proof.truth.specimen import draw_specimen

SHORT = 500
SEED = 6
EVERY_TEST = range(len(TESTS))


def _driven_by(line, load_nm, start):
    """Recordings of a line: PRBS of its own drawing, without noise."""
    rng = np.random.default_rng(1)
    torques = [np.repeat(rng.choice([-80.0, 80.0], SHORT // 2), 2) + 100.0 for _ in EVERY_TEST]
    return [Heard(t, line.speed_rad_s(t, load_nm, start), np.ones(SHORT, dtype=np.bool_)) for t in torques]


def _rms(rests):
    return float(np.sqrt(np.mean(np.concatenate(rests) ** 2)))


def test_another_bus_inside_the_tolerances_leaves_nothing():
    specimen = draw_specimen("none", SEED)
    other = line_of(scaled(specimen.bus, {"J_M": 1.02, "k": 0.98, "c": 1.02, "b_L": 0.99}))
    recordings = _driven_by(other, 55.0, np.array([0.02, 50.0, 49.5]))
    assert _rms(retuned_rest_rad_s(specimen, recordings)) < 1e-5


def test_a_bus_beyond_the_tolerances_is_a_mismatch():
    specimen = draw_specimen("none", SEED)
    beyond = (1.0 + NOMINAL_TOLERANCE) * specimen.nominal["k"] / specimen.bus.k
    recordings = _driven_by(line_of(scaled(specimen.bus, {"k": 1.1 * beyond})), 55.0, np.zeros(3))
    assert _rms(retuned_rest_rad_s(specimen, recordings)) > SPEED_NOISE_RAD_S


def test_rows_that_are_not_good_do_not_count():
    specimen = draw_specimen("none", SEED)
    recordings = _driven_by(line_of(specimen.bus), 55.0, np.zeros(3))
    lost = np.arange(SHORT) % 7 == 3
    spoilt = [replace(each, speed_rad_s=np.where(lost, 0.0, each.speed_rad_s), good=~lost) for each in recordings]
    rests = retuned_rest_rad_s(specimen, spoilt)
    assert _rms(rests) < 1e-6
    assert not any(rest[lost].any() for rest in rests)
    trusted = [replace(each, good=np.ones(SHORT, dtype=np.bool_)) for each in spoilt]
    assert _rms(retuned_rest_rad_s(specimen, trusted)) > SPEED_NOISE_RAD_S


def test_of_a_small_effect_what_the_projector_of_the_power_study_leaves_is_left():
    """Friction of 0.5 Nm: 0.3 % of the torque, so that the second order is small next to the first."""
    specimen = imposed(draw_specimen("coulomb_friction_motor", SEED), 0.5)
    there = [drive(specimen, test, SHORT) for test in EVERY_TEST]
    absent = [under_torques_of(each, draw_specimen("none", SEED), test) for test, each in enumerate(there)]
    speeds = [each.speed_rad_s() for each in there]
    delta = np.concatenate([a - b.speed_rad_s() for a, b in zip(speeds, absent, strict=True)])
    projected = without(orthonormal(sensitivities(SEED, SHORT)), delta)
    recordings = [
        Heard(each.m1_nm + each.m2_nm, speed, np.ones(SHORT, dtype=np.bool_))
        for each, speed in zip(there, speeds, strict=True)
    ]
    rest = np.concatenate(retuned_rest_rad_s(specimen, recordings))
    assert np.linalg.norm(rest - projected) < 0.05 * np.linalg.norm(projected)
    assert np.linalg.norm(projected) < 0.5 * np.linalg.norm(delta)


def test_a_recording_without_noise_has_the_same_faults_in_the_same_samples():
    specimen = draw_specimen("lost_samples", SEED)
    noisy, silent = record(specimen, 0), record(specimen, 0, SILENT)
    missing = np.isnan(noisy.torque_m1_nm + noisy.torque_m2_nm) | np.isnan(noisy.speed_rad_s)
    assert np.array_equal(noisy.torque_ref_nm, silent.torque_ref_nm)
    said = heard(silent)
    flagged = np.zeros(missing.size, dtype=np.bool_) if silent.flags is None else silent.flags != 0
    assert np.array_equal(said.good, ~(missing | flagged))
    kept = said.good & (np.abs(noisy.speed_rad_s) > 0.0)  # a loss may be reported as 0
    assert silent.speed_rad_s[kept] == pytest.approx(silent.speed_true_rad_s[kept])
    assert np.std((noisy.speed_rad_s - silent.speed_rad_s)[kept]) == pytest.approx(SPEED_NOISE_RAD_S, rel=0.1)


def test_a_missing_torque_is_held():
    recording = record(draw_specimen("none", SEED), 0, SILENT)
    torque_nm = recording.torque_m1_nm.copy()
    torque_nm[[10, 11, 40]] = np.nan
    said = heard(replace(recording, torque_m1_nm=torque_nm))
    assert said.torque_nm[11] == said.torque_nm[10] == said.torque_nm[9]
    assert said.good.sum() == said.good.size - 3


def test_a_case_with_nothing_hidden_leaves_nothing():
    assert _rms(true_rest_rad_s(draw_specimen("none", SEED))) < 1e-6
