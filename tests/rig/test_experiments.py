"""Experiments: what they ask for, open and closed loop, their excitation and its share of both inverters."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hil.config.rig_file import read_rig
from hil.errors import HilError, RigFileError, RunAborted
from hil.rig.excitation import Split
from hil.rig.experiments.base import MeasureLaw, Phase
from hil.rig.experiments.laws import Cruise, Pulses, Reversal, Tip
from hil.rig.experiments.open_loop import OpenLoop
from hil.rig.experiments.staged import Approach, StagedExperiment, TorqueBounds
from hil.rig.plan import plan_run
from tests.rig.serving import EXAMPLE
from tests.rig.vehicle import INERTIA_KG_M2, PERIOD_S, RigidVehicle, drive

BOUNDS = TorqueBounds(torque_nm=500.0, slew_nm_per_s=4000.0)


def staged(law: MeasureLaw, timeout_s: float = 120.0) -> StagedExperiment:
    approach = Approach(law.start_speed_rad_s, INERTIA_KG_M2, BOUNDS.torque_nm, PERIOD_S, timeout_s)
    return StagedExperiment(law, approach, BOUNDS, PERIOD_S)


def cruise(speed_rad_s: float = 40.0, duration_s: float = 20.0) -> Cruise:
    return Cruise(speed_rad_s, duration_s, INERTIA_KG_M2, BOUNDS.torque_nm, PERIOD_S)


LAWS = {
    "cruise": cruise,
    "reversal": lambda: Reversal(0.0, 20.0, 8.0, swing_nm=400.0, period_s=PERIOD_S),
    "tip": lambda: Tip(30.0, 20.0, step_nm=300.0, step_s=1.5),
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
    law = Reversal(0.0, 30.0, 8.0, swing_nm=400.0, period_s=PERIOD_S)
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


shares = st.floats(0.0, 1.0)
torques = st.floats(-1e3, 1e3)


@given(shares, shares, torques, torques)
def test_total_is_kept(base_m1: float, prbs_m1: float, base_nm: float, prbs_nm: float) -> None:
    request = Split(base_m1, prbs_m1).request(base_nm, prbs_nm)
    assert request.base_m1_nm + request.base_m2_nm == pytest.approx(base_nm, abs=1e-9)
    assert request.prbs_m1_nm + request.prbs_m2_nm == pytest.approx(prbs_nm, abs=1e-9)


def test_one_inverter_alone_can_carry_the_prbs() -> None:
    request = Split(base_m1=0.5, prbs_m1=0.0).request(100.0, 40.0)
    assert (request.total_m1_nm, request.total_m2_nm) == (50.0, 90.0)


def test_larger_base_share() -> None:
    assert Split(0.3, 0.5).largest_base_share == 0.7


RIG = Path("examples/rig.toml")


def test_the_inverters_share_the_base_torque_as_the_experiment_says() -> None:
    rig = read_rig(RIG)
    shares = {name: plan_run(rig, name).split.base_m1 for name in rig.experiments}
    assert shares == {"cruise": 0.5, "reversal": 0.65, "tip": 0.35}
    request = plan_run(rig, "reversal").split.request(200.0, 40.0)
    assert (request.base_m1_nm, request.base_m2_nm) == pytest.approx((130.0, 70.0))
    assert (request.prbs_m1_nm, request.prbs_m2_nm) == pytest.approx((20.0, 20.0))  # the PRBS has a share of its own


def test_a_share_beyond_all_of_it_is_refused_with_its_key(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG.read_text().replace("share_m1 = 0.65", "share_m1 = 1.65"))
    with pytest.raises(HilError, match=r"experiments\.reversal.*share_m1"):
        read_rig(path)


STEP_NM, INERTIA = 20.0, 100.0


def pulses(most_speed_rad_s: float = 1.0) -> OpenLoop:
    return OpenLoop(Pulses(18.0, STEP_NM, 1.0), 1000.0, most_speed_rad_s, PERIOD_S)


def test_pulses_bring_speed_and_place_back() -> None:
    vehicle = RigidVehicle(inertia_kg_m2=INERTIA, friction_nm_s=0.0)
    course = drive(pulses(), vehicle)
    assert max(course.torque_nm) == STEP_NM == -min(course.torque_nm)
    assert max(course.speed_rad_s) == pytest.approx(STEP_NM * 1.0 / INERTIA, rel=0.03)  # J dw = T dt
    assert abs(vehicle.speed_rad_s) < 0.01
    assert abs(vehicle.angle_rad) < 0.05  # the ramps of 20 and 40 ms between the steps differ; the swing is 0.4 rad
    assert course.phase[-1] is Phase.DONE
    assert course.torque_nm[-1] == 0.0


def test_vehicle_that_moves_is_refused_before_any_torque() -> None:
    with pytest.raises(RunAborted, match=r"the speed is 3\.00 rad/s at the beginning, expected standstill"):
        drive(pulses(), RigidVehicle(speed_rad_s=3.0))


def test_vehicle_that_runs_away_ends_it() -> None:
    with pytest.raises(RunAborted, match=r"expected at most 0\.1 rad/s either way"):
        drive(pulses(most_speed_rad_s=0.1), RigidVehicle(inertia_kg_m2=INERTIA))


def test_rig_file_has_them_and_holds_them_against_its_limits(tmp_path) -> None:  # type: ignore[no-untyped-def]
    text = EXAMPLE.read_text(encoding="utf-8")
    tables = (
        '\n[experiments.p]\nkind = "pulses"\nduration_s = 6.0\nstep_nm = 20.0\nstep_s = 1.0\nslew_nm_per_s = 500.0\n'
        'most_speed_rad_s = 1.0\nshare_m1 = 1.0\n[experiments.r]\nkind = "rest"\nduration_s = 1.0\n'
    )
    path = tmp_path / "rig.toml"
    path.write_text(text + tables, encoding="utf-8")
    rig = read_rig(path)
    plan = plan_run(rig, "p")
    assert plan.prbs_nm(Phase.MEASURE) == 0.0
    assert plan.needs.torque_of_one_nm == 20.0
    assert plan_run(rig, "r").needs.torque_of_one_nm == 0.0
    path.write_text((text + tables).replace("step_nm = 20.0", "step_nm = 900.0"), encoding="utf-8")
    with pytest.raises(RigFileError, match=r"experiments\.p\.torque_nm"):
        read_rig(path)
