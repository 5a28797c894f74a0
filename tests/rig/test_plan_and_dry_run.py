"""On paper before anything is driven: plan, dry run, and whether the vehicle is fit."""

import pytest

from drivers.errors import CommandRefused
from hil.config.rig_file import read_rig
from hil.errors import RunAborted
from hil.rig.dry_run import dry_run
from hil.rig.plan import plan_run
from tests.rig.serving import EXAMPLE, changed


def test_needs_are_the_worst_case_of_one_inverter() -> None:
    plan = plan_run(read_rig(EXAMPLE), "cruise")
    assert plan.needs.torque_of_one_nm == 500.0 / 2 + 120.0 / 2


@pytest.mark.parametrize("experiment", ["cruise", "reversal", "tip"])
def test_example_can_be_driven(experiment: str) -> None:
    rig = read_rig(EXAMPLE)
    prediction = dry_run(rig, experiment)
    table = rig.experiments[experiment]
    assert prediction.measured * prediction.period_s == pytest.approx(table.duration_s)
    assert prediction.cycles > prediction.measured
    assert max(abs(prediction.torque_nm.low), abs(prediction.torque_nm.high)) <= table.torque_nm
    for one in (prediction.torque_m1_nm, prediction.torque_m2_nm):
        assert max(abs(one.low), abs(one.high)) <= rig.inverters.m1.torque_limit_nm


def test_speed_is_predicted_from_the_simulation_model() -> None:
    prediction = dry_run(read_rig(EXAMPLE), "cruise")
    assert prediction.vehicle.inertia_kg_m2 == pytest.approx(101.6)
    assert prediction.vehicle.friction_nm_s == pytest.approx(1.25)
    assert prediction.speed_measured_rad_s.low == pytest.approx(60.0, rel=0.05)
    assert prediction.speed_measured_rad_s.high == pytest.approx(60.0, rel=0.05)


def test_plan_the_guard_would_refuse_is_refused_on_paper() -> None:
    with pytest.raises(CommandRefused, match="prbs_limit_nm"):
        dry_run(changed(read_rig(EXAMPLE), {"guard": {"prbs_limit_nm": 50.0}}), "cruise")


def test_speed_out_of_reach_is_seen_on_paper() -> None:
    rig = changed(read_rig(EXAMPLE), {"experiments.cruise": {"speed_rad_s": 1e4, "approach_timeout_s": 5.0}})
    with pytest.raises(RunAborted, match="approach"):
        dry_run(rig, "cruise")
