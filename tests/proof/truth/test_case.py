"""Cases: repeatable, well formed, and with the effect in the recordings but not in the files a tool sees."""

import subprocess
import sys
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

from hil.errors import UsageError
from hil.proof.truth.case import TESTS, make_case, record
from hil.proof.truth.hidden import same_physics, same_recording
from hil.proof.truth.recording import FAULTLESS, SPEED_NOISE_RAD_S, TORQUE_QUANTUM_NM
from hil.proof.truth.specimen import EFFECTS, draw_specimen
from tests.chosen import one_in

SEED = 11


@pytest.fixture(scope="module")
def nothing():
    return make_case("none", SEED)


def test_the_same_seed_gives_the_same_case(nothing):
    again = draw_specimen("none", SEED)
    assert again == nothing.specimen
    one, other = record(again, 0), nothing.recordings[0]
    np.testing.assert_array_equal(one.speed_rad_s, other.speed_rad_s)
    np.testing.assert_array_equal(one.torque_m1_nm, other.torque_m1_nm)


@pytest.mark.parametrize("name", one_in(5, [name for name in EFFECTS if name != "none"]))
def test_every_effect_shows_in_the_recordings_and_changes_nothing_else(nothing, name):
    specimen = draw_specimen(name, SEED)
    assert specimen.bus == nothing.specimen.bus
    assert specimen.nominal == nothing.specimen.nominal
    assert any(_shows(record(specimen, test), nothing.recordings[test]) for test in range(len(TESTS)))


def _shows(recording, without):
    """Say whether an effect can be seen; the driver must have done the same all the while."""
    np.testing.assert_allclose(np.diff(recording.torque_ref_nm), np.diff(without.torque_ref_nm), atol=1e-9)
    assert np.abs(recording.speed_true_rad_s).max() < 150.0
    return _change(recording, without) > 0.5 * SPEED_NOISE_RAD_S


def _change(recording, without):
    """RMS change of the speed, or the rows that are gone."""
    gone = np.count_nonzero(~np.isfinite(recording.speed_rad_s + recording.torque_m1_nm + recording.torque_m2_nm))
    return np.sqrt(np.nanmean((recording.speed_rad_s - without.speed_rad_s) ** 2)) + gone


@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if effect.corrupt is not same_recording])
def test_what_spoils_a_recording_leaves_the_driveline(name):
    specimen = draw_specimen(name, SEED)
    assert specimen.physics(np.random.default_rng(1)) == draw_specimen("none", SEED).physics(np.random.default_rng(1))
    assert specimen.acquisition() != FAULTLESS


def test_an_effect_is_of_the_driveline_or_of_the_recording():
    for name, effect in EFFECTS.items():
        changed = [effect.apply is not same_physics, effect.corrupt is not same_recording]
        assert sum(changed) == (name != "none"), name


def test_any_two_effects_of_different_physics_can_be_hidden_together():
    refused = set()
    for one, other in combinations(EFFECTS, 2):
        try:
            draw_specimen(f"{one}+{other}", SEED).physics(np.random.default_rng(1))
        except UsageError:
            refused.add((one, other))
    assert refused == {("coulomb_friction_motor", "stribeck_friction"), ("road_grade", "corrugated_road")}


def test_two_effects_of_one_place_are_refused_with_what_both_set():
    with pytest.raises(UsageError, match=r"coulomb_friction_motor and stribeck_friction both set friction_motor_nm"):
        draw_specimen("coulomb_friction_motor+stribeck_friction", SEED)
    with pytest.raises(UsageError, match="both set gap_rad"):
        draw_specimen("backlash+backlash", SEED)


EVENTS = [name for name, effect in EFFECTS.items() if effect.when is not None]


@pytest.mark.usefixtures("brief")  # the times are drawn, not recorded
@pytest.mark.parametrize("name", EVENTS)
def test_the_truth_has_the_times_of_an_event_in_each_recording(name):
    case = make_case(name, SEED)
    reported = case.truth()["events"][name]
    assert list(reported) == ["run_1", "run_2", "run_3", "fresh_1", "fresh_2", "fresh_3"]
    for intervals in reported.values():
        assert all(3.0 < begin < end <= 30.0 for begin, end in intervals)
    absent = [test for test in range(3) if not case.specimen.effects[0].happens_in(test, case.specimen.sizes[name])]
    assert [test for test, intervals in enumerate(list(reported.values())[:3]) if not intervals] == absent


@pytest.mark.parametrize("name", EVENTS)
def test_an_event_is_sometimes_absent_from_one_recording_and_never_from_all(name):
    effect, present = EFFECTS[name], Counter()
    for seed in range(60):
        sizes = draw_specimen(name, seed).sizes[name]
        present[sum(effect.happens_in(test, sizes) for test in range(3))] += 1
    assert present[3] > 10 < present[2]
    assert present[0] == 0


def test_sensors_have_the_resolution_and_noise_they_state(nothing):
    for recording in nothing.recordings:
        counts = recording.torque_m1_nm / TORQUE_QUANTUM_NM
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
        noise = recording.speed_rad_s - recording.speed_true_rad_s
        assert np.std(noise) == pytest.approx(SPEED_NOISE_RAD_S, rel=0.06)  # 4.6 sigma of 3000 samples
        error = recording.torque_m1_nm + recording.torque_m2_nm - recording.torque_ref_nm
        assert abs(error.mean()) < 0.08
        assert 0.5 < np.std(error) < 1.0


def test_the_simulator_does_not_load_the_estimator():
    code = "import sys, hil.proof.truth.case; sys.exit(any(m.startswith('estimator') for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
