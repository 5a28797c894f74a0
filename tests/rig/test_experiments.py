"""Every kind of experiment on a vehicle of one inertia: speed reached, torque bounded, ended at zero."""

import math

import numpy as np
import pytest

from hil.rig.experiments.base import MeasureLaw, Phase
from hil.rig.experiments.cruise import Cruise
from hil.rig.experiments.reversal import Reversal
from hil.rig.experiments.staged import Approach, StagedExperiment, TorqueBounds
from hil.rig.experiments.tip import Tip
from tests.rig.vehicle import INERTIA_KG_M2, PERIOD_S, RigidVehicle, drive

BOUNDS = TorqueBounds(torque_nm=500.0, slew_nm_per_s=4000.0)


def staged(law: MeasureLaw, timeout_s: float = 120.0) -> StagedExperiment:
    approach = Approach(law.start_speed_rad_s, INERTIA_KG_M2, BOUNDS.torque_nm, PERIOD_S, timeout_s)
    return StagedExperiment(law, approach, BOUNDS, PERIOD_S)


def cruise(speed_rad_s: float = 40.0, duration_s: float = 20.0) -> Cruise:
    return Cruise(speed_rad_s, duration_s, INERTIA_KG_M2, BOUNDS.torque_nm, PERIOD_S)


LAWS = {
    "cruise": cruise,
    "reversal": lambda: Reversal(8.0, swing_nm=400.0, duration_s=20.0, period_s=PERIOD_S),
    "tip": lambda: Tip(speed_rad_s=30.0, step_nm=300.0, step_s=1.5, duration_s=20.0),
}


@pytest.mark.parametrize("kind", LAWS)
def test_measures_as_long_as_ordered_and_ends_at_zero_torque(kind: str) -> None:
    course = drive(staged(LAWS[kind]()), RigidVehicle())
    assert len(course.measured(course.torque_nm)) == 2000
    assert course.torque_nm[-1] == 0.0
    order = list(dict.fromkeys(course.phase))
    assert order == [Phase.APPROACH, Phase.MEASURE, Phase.RELEASE, Phase.DONE]


@pytest.mark.parametrize("kind", LAWS)
@pytest.mark.parametrize("load_nm", [-150.0, 0.0, 150.0])
def test_never_leaves_its_bounds(kind: str, load_nm: float) -> None:
    torque = np.array(drive(staged(LAWS[kind]()), RigidVehicle(load_nm=load_nm)).torque_nm)
    assert np.abs(torque).max() <= BOUNDS.torque_nm
    assert np.abs(np.diff(torque)).max() <= BOUNDS.slew_nm_per_s * PERIOD_S + 1e-9


@pytest.mark.parametrize("load_nm", [-100.0, 0.0, 100.0])
def test_cruise_keeps_near_its_speed_with_little_torque_movement(load_nm: float) -> None:
    course = drive(staged(cruise()), RigidVehicle(load_nm=load_nm))
    speed = np.array(course.measured(course.speed_rad_s))
    assert np.abs(speed - 40.0).max() < 0.05 * 40.0
    assert np.abs(np.diff(course.measured(course.torque_nm))).max() < 1.0


def test_cruise_does_not_answer_at_the_frequencies_that_are_identified() -> None:
    """At 0.3 Hz the loop gives back less than 1 % of the torque that makes such a speed in the vehicle."""
    law = cruise(speed_rad_s=0.0, duration_s=math.inf)
    omega = 2.0 * math.pi * 0.3
    time_s = np.arange(0.0, 100.0, PERIOD_S)
    torque = np.array([law.torque_nm(t, math.sin(omega * t)) for t in time_s])
    late = time_s > 50.0
    amplitude = 2.0 * abs(np.mean(torque[late] * np.exp(-1j * omega * time_s[late])))
    assert amplitude < 0.01 * INERTIA_KG_M2 * omega


@pytest.mark.parametrize("load_nm", [-100.0, 0.0, 100.0])
def test_reversal_crosses_standstill_several_times(load_nm: float) -> None:
    law = Reversal(8.0, swing_nm=400.0, duration_s=30.0, period_s=PERIOD_S)
    course = drive(staged(law), RigidVehicle(load_nm=load_nm))
    speed = np.array(course.measured(course.speed_rad_s))
    crossings = np.count_nonzero(np.diff(np.sign(speed[speed != 0.0])))
    assert crossings >= 4
    assert np.abs(speed).max() < 1.2 * 8.0


def test_tip_steps_through_zero_torque_and_keeps_its_mean_speed() -> None:
    course = drive(staged(LAWS["tip"]()), RigidVehicle())
    torque = np.array(course.measured(course.torque_nm))
    assert torque.max() > 250.0
    assert torque.min() < -250.0
    assert np.mean(course.measured(course.speed_rad_s)) == pytest.approx(30.0, abs=1.5)


def test_a_resolver_whose_error_goes_round_with_the_shaft_does_not_keep_the_vehicle_from_being_there() -> None:
    """An error of 3 rad/s at the start speed, nine times a second; the speed itself is steady after some time."""
    law = cruise(speed_rad_s=60.0)
    course = drive(staged(law), RigidVehicle(resolver_error_rad=0.05))
    assert Phase.MEASURE in course.phase
