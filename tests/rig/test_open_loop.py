"""Experiments without a speed controller: pulses that bring the vehicle back, and rest."""

import pytest

from hil.config.rig_file import read_rig
from hil.errors import RigFileError, RunAborted
from hil.rig.experiments.base import Phase
from hil.rig.experiments.open_loop import OpenLoop
from hil.rig.experiments.pulses import Pulses
from hil.rig.plan import plan_run
from tests.rig.serving import EXAMPLE
from tests.rig.vehicle import PERIOD_S, RigidVehicle, drive

STEP_NM, INERTIA = 20.0, 100.0


def pulses(most_speed_rad_s: float = 1.0) -> OpenLoop:
    return OpenLoop(Pulses(STEP_NM, 1.0, 18.0), 1000.0, most_speed_rad_s, PERIOD_S)


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
