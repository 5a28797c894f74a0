"""The best possible tests: against closed solutions, against drawn noise, and against the truth simulator."""

import math

import numpy as np
import pytest

from hil.errors import UsageError
from hil.proof.power.bound import (
    HYPOTHESES,
    LEVEL,
    POWER,
    Yardstick,
    needed_distance,
    power,
    size_at,
    threshold,
)
from hil.proof.power.case import trial_case
from hil.proof.power.drive import drive, under_torques_of
from hil.proof.power.noise import answer_rad_s, deviation_rad_s, torque_deviation_nm, whitened
from hil.proof.power.nuisance import orthonormal, sensitivities, without
from hil.proof.power.sizes import SCALES, imposed
from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.case import record
from hil.proof.truth.sensors import SPEED_NOISE_RAD_S
from hil.proof.truth.specimen import draw_specimen

ALPHA = LEVEL / HYPOTHESES
SHORT = 300


def test_a_linear_difference_has_the_size_of_the_closed_solution():
    direction = np.array([3.0, 4.0])
    needed = needed_distance(0.05)
    found = size_at(needed, lambda size: float(np.linalg.norm(size * direction)) / 0.1, start=1.0)
    assert found == pytest.approx(0.1 * (1.6448536 + 1.2815516) / 5.0, rel=2e-3)
    assert power(needed, 0.05) == pytest.approx(POWER)
    assert power(0.0, 0.05) == pytest.approx(0.05)


def test_a_size_is_found_from_far_below_and_above_and_of_a_bent_difference():
    for start in (1e-4, 1e3):
        assert size_at(9.0, lambda size: size**2, start) == pytest.approx(3.0, rel=2e-3)


@pytest.mark.parametrize(("distance", "got"), [(lambda size: 0.0, "got 0 at"), (lambda size: 7.0, "got 7 at")])
def test_a_distance_that_never_or_always_suffices_is_refused(distance, got):
    with pytest.raises(ValueError, match=got):
        size_at(4.0, distance, 1.0)


def test_the_power_is_what_drawn_noise_gives():
    rng = np.random.default_rng(5)
    difference = rng.normal(size=20)
    difference *= 3.0 / np.linalg.norm(difference)
    seen = rng.normal(size=(20000, 20)) + difference
    log_ratio = seen @ difference - 0.5 * difference @ difference
    level = rng.normal(size=(20000, 20)) @ difference - 0.5 * difference @ difference
    share = np.mean(log_ratio > np.quantile(level, 1.0 - 0.01))
    assert share == pytest.approx(power(3.0, 0.01), abs=0.02)


def test_a_stricter_level_asks_for_more_and_rounding_adds_noise():
    assert threshold(0.001) > threshold(0.01) > 0.0
    assert deviation_rad_s(Acquisition()) == SPEED_NOISE_RAD_S
    assert deviation_rad_s(Acquisition(grid_rad_s=0.1)) == pytest.approx(math.hypot(0.05, 0.1 / math.sqrt(12.0)))


def test_what_the_bus_could_imitate_is_taken_out_and_nothing_else():
    basis = orthonormal(np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    assert basis.shape == (3, 1)  # two columns are collinear, the third moves nothing
    assert without(basis, np.array([5.0, 3.0, -4.0])) == pytest.approx([0.0, 3.0, -4.0])


@pytest.mark.parametrize("test", [0, 1, 2])
def test_a_drive_is_what_the_recorder_sees_without_noise(test):
    specimen = draw_specimen("backlash", 1)
    seen = record(specimen, test)
    driven = drive(specimen, test, SHORT)
    assert driven.speed_rad_s() == pytest.approx(seen.speed_true_rad_s[:SHORT], abs=1e-8)
    assert driven.m1_nm + driven.m2_nm == pytest.approx(seen.torque_ref_nm[:SHORT])


@pytest.mark.parametrize("name", ["J_M", "k", "b_L", "load_torque_nm"])
def test_another_bus_is_no_effect(name):
    here = drive(draw_specimen("none", 2), 0, SHORT)
    physics = here.physics._replace(**{name: 1.01 * getattr(here.physics, name)})
    other = type(here)(physics, here.state, here.m1_nm, here.m2_nm)
    moved = np.zeros(3 * SHORT)
    moved[:SHORT] = other.speed_rad_s() - here.speed_rad_s()
    moved_all = moved if name == "load_torque_nm" else _moved_in_all(name)
    assert np.linalg.norm(without(orthonormal(sensitivities(2, SHORT)), moved_all)) < 0.02 * np.linalg.norm(moved_all)


def _moved_in_all(name):
    moved = []
    for test in range(3):
        here = drive(draw_specimen("none", 2), test, SHORT)
        physics = here.physics._replace(**{name: 1.01 * getattr(here.physics, name)})
        moved.append(type(here)(physics, here.state, here.m1_nm, here.m2_nm).speed_rad_s() - here.speed_rad_s())
    return np.concatenate(moved)


@pytest.mark.parametrize("effect", SCALES)
def test_the_distance_grows_with_the_size_and_is_less_to_who_does_not_know_the_bus(effect):
    yardstick = Yardstick(draw_specimen(effect, 3), SHORT)
    distances = [yardstick.distance(factor * SCALES[effect].start) for factor in (0.5, 1.0, 2.0)]
    for name in ("known", "bus_unknown", "recorded"):
        grown = [getattr(distance, name) for distance in distances]
        assert grown == sorted(grown)
        assert grown[0] < 0.9 * grown[2]
    assert all(distance.recorded < distance.bus_unknown < distance.known for distance in distances)


def test_the_bound_is_where_the_best_test_has_its_power():
    yardstick = Yardstick(draw_specimen("coulomb_friction_motor", 3), SHORT)
    bound = yardstick.bound(ALPHA)
    assert bound.known < bound.bus_unknown < bound.recorded
    for name in ("known", "bus_unknown", "recorded"):
        distance = getattr(yardstick.distance(getattr(bound, name)), name)
        assert power(distance, ALPHA) == pytest.approx(POWER, abs=2e-3)
    assert yardstick.bound(0.01 * ALPHA).recorded > bound.recorded


def test_a_size_replaces_the_drawn_one_on_its_side():
    for seed in range(6):
        specimen = draw_specimen("inverter_gain_mismatch", seed)
        drawn = specimen.sizes["inverter_gain_mismatch"]["gain_m1"] - 1.0
        given = imposed(specimen, 0.02).sizes["inverter_gain_mismatch"]["gain_m1"] - 1.0
        assert given == pytest.approx(math.copysign(0.02, drawn))
    with pytest.raises(UsageError, match="single size"):
        imposed(draw_specimen("road_grade", 1), 1.0)


def test_no_effect_is_a_driveline_without_it():
    specimen = imposed(draw_specimen("quadratic_friction", 4), 0.0)
    absent = drive(draw_specimen("none", 4), 0, SHORT)
    assert np.array_equal(under_torques_of(absent, specimen, 0).speed_rad_s(), absent.speed_rad_s())


def test_each_trial_has_noise_of_its_own_and_the_same_bus_and_drive():
    specimen = draw_specimen("actuator_lag", 1)
    one, two, again = (trial_case(specimen, 0.002, trial, SHORT) for trial in (7, 8, 7))
    assert np.array_equal(one.recordings[1].speed_rad_s, again.recordings[1].speed_rad_s)
    assert not np.array_equal(one.recordings[1].speed_rad_s, two.recordings[1].speed_rad_s)
    assert np.array_equal(one.recordings[1].speed_true_rad_s, two.recordings[1].speed_true_rad_s)
    noise = np.concatenate([r.speed_rad_s - r.speed_true_rad_s for r in one.recordings])
    assert noise.std() == pytest.approx(SPEED_NOISE_RAD_S, rel=0.1)
    assert one.truth()["hidden"] == {"actuator_lag": {"current_loop_time_s": 0.002}}


def test_the_noise_of_free_runs_is_white_once_it_is_whitened():
    """Free runs of the linear truth under torques with noise, which the test draws itself."""
    rng = np.random.default_rng(6)
    answer = answer_rad_s(2, SHORT)
    torque = rng.normal(0.0, torque_deviation_nm(), (SHORT, 400))
    moved = np.stack([np.convolve(each, answer)[:SHORT] for each in torque.T], axis=1)
    errors = moved + rng.normal(0.0, SPEED_NOISE_RAD_S, (SHORT, 400))
    white = whitened(errors, 2, SHORT)
    slow = np.ones(SHORT) / math.sqrt(SHORT)
    assert np.var(white) == pytest.approx(1.0, abs=0.02)
    assert np.var(slow @ white) == pytest.approx(1.0, abs=0.3)
    assert abs(_next_to_each_other(white)) < 0.01  # three deviations of 120000 draws
    assert _next_to_each_other(errors) > 0.02  # seven of them


def _next_to_each_other(errors):
    return np.mean(errors[1:] * errors[:-1]) / np.mean(errors**2)
