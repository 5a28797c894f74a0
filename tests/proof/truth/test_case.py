"""Cases: repeatable, well formed, and with the effect in the recordings but not in the files a tool sees."""

import subprocess
import sys

import numpy as np
import pytest

from hil.errors import UsageError
from hil.proof.truth.bus import NOMINAL_ERROR, NOMINAL_TOLERANCE
from hil.proof.truth.case import TESTS, make_case, record
from hil.proof.truth.hidden import Place
from hil.proof.truth.registry import EFFECTS, find
from hil.proof.truth.sensors import SPEED_NOISE_RAD_S, TORQUE_QUANTUM_NM
from hil.proof.truth.specimen import draw_specimen

SEED = 11


@pytest.fixture(scope="module")
def nothing():
    return make_case("none", SEED)


def test_the_same_seed_gives_the_same_case(nothing):
    again = make_case("none", SEED)
    assert again.truth() == nothing.truth()
    for one, other in zip(nothing.recordings + nothing.fresh, again.recordings + again.fresh, strict=True):
        np.testing.assert_array_equal(one.speed_rad_s, other.speed_rad_s)
        np.testing.assert_array_equal(one.torque_m1_nm, other.torque_m1_nm)


def test_another_seed_gives_another_bus(nothing):
    assert make_case("none", SEED + 1).specimen.bus != nothing.specimen.bus


@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "none"])
def test_every_effect_shows_in_the_recordings_and_changes_nothing_else(nothing, name):
    specimen = draw_specimen(name, SEED)
    assert specimen.bus == nothing.specimen.bus
    assert specimen.nominal == nothing.specimen.nominal
    recordings = [record(specimen, number) for number in range(len(TESTS))]
    moved = [
        np.std(with_it.speed_true_rad_s - without.speed_true_rad_s)
        for with_it, without in zip(recordings, nothing.recordings, strict=True)
    ]
    assert max(moved) > SPEED_NOISE_RAD_S
    assert all(np.abs(recording.speed_true_rad_s).max() < 150.0 for recording in recordings)


def test_a_pair_holds_both():
    pair = draw_specimen("backlash+actuator_lag", SEED)
    assert set(pair.sizes) == {"backlash", "actuator_lag"}
    assert pair.sizes["backlash"] == draw_specimen("backlash", SEED).sizes["backlash"]
    assert pair.truth()["element"] == ["shaft", "torque_path"]
    physics = pair.physics(np.random.default_rng(1))
    assert physics.gap_rad > 0.0 < physics.current_loop_time_s


def test_sensors_have_the_resolution_and_noise_they_state(nothing):
    for recording in nothing.recordings:
        counts = recording.torque_m1_nm / TORQUE_QUANTUM_NM
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
        noise = recording.speed_rad_s - recording.speed_true_rad_s
        assert np.std(noise) == pytest.approx(SPEED_NOISE_RAD_S, rel=0.06)  # 4.6 sigma of 3000 samples
        error = recording.torque_m1_nm + recording.torque_m2_nm - recording.torque_ref_nm
        assert abs(error.mean()) < 0.08
        assert 0.5 < np.std(error) < 1.0


def test_the_tests_are_what_their_names_say(nothing):
    cruise, reversal, tip = nothing.recordings
    assert cruise.speed_rad_s.min() > 20.0
    assert np.count_nonzero(np.diff(np.sign(reversal.speed_true_rad_s))) >= 3
    assert tip.speed_rad_s.min() > 20.0
    assert tip.torque_ref_nm.min() < 0.0 < tip.torque_ref_nm.max()
    shares = [np.polyfit(r.torque_ref_nm, r.torque_m1_nm, 1)[0] for r in nothing.recordings]
    assert min(abs(a - b) for a, b in zip(shares, shares[1:] + shares[:1], strict=True)) > 0.03
    assert len(TESTS) == 3


def test_held_torques_act_from_their_row_on(nothing):
    """Zero-order hold: the first sample after a torque step has moved, the one at the step has not."""
    cruise = nothing.recordings[0]
    step = np.diff(cruise.torque_ref_nm)
    change = np.diff(cruise.speed_true_rad_s)
    assert np.corrcoef(step[:-1], change[1:] - change[:-1])[0, 1] > 0.7


def test_no_nominal_value_is_outside_its_tolerance(nothing):
    for name, nominal in nothing.specimen.nominal.items():
        true = getattr(nothing.specimen.bus, name)
        assert abs(nominal / true - 1.0) <= NOMINAL_ERROR
        assert abs(true / nominal - 1.0) < NOMINAL_TOLERANCE


def test_the_truth_knows_where_the_load_was_disturbed():
    braked = draw_specimen("brake_drag", SEED)
    disturbance_nm = record(braked, 0).disturbance_nm
    assert disturbance_nm[0] == 0.0
    assert disturbance_nm.max() == pytest.approx(braked.sizes["brake_drag"]["brake_nm"], abs=1e-3)
    hills = draw_specimen("road_grade", SEED)
    assert np.ptp(record(hills, 0).disturbance_nm) > 10.0


def test_the_sealed_truth_has_the_disturbance_of_each_recording(nothing):
    truth = nothing.truth()
    assert truth["disturbance_period_s"] == 0.25
    assert truth["disturbance_nm"] == truth["disturbance_fresh_nm"] == [[0.0] * 120] * 3


def test_an_unknown_effect_is_refused_with_the_known_ones():
    with pytest.raises(UsageError, match=r"'blacklash': expected one of none, .*backlash"):
        find("blacklash")


def test_what_is_outside_the_catalogue_says_so():
    outside = {name for name, effect in EFFECTS.items() if not effect.catalogued}
    assert outside == {"maxwell_shaft"}
    assert EFFECTS["none"].place is Place.NOWHERE


def test_the_simulator_does_not_load_the_estimator():
    code = "import sys, hil.proof.truth.case; sys.exit(any(m.startswith('estimator') for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
