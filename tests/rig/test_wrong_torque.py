"""Drives that give another torque than they are asked for, from some moment on or from the start: reported, ended."""

import pytest

from drivers.errors import WrongTorque
from hil.sample import SampleFlag
from hil.simulator.fault_table import rig_faults
from tests.chosen import one_in
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, run_once, served, small_rig

FROM_S = 4.3
"""In the middle of the measured part."""

NOTICED_S = 0.3

TOGETHER = "both inverters: torque actual value"


@pytest.mark.parametrize(
    ("faults", "named"),
    [
        (["m1.torque_gain@{}=2"], "inverter m1: torque actual value"),
        (["m1.torque_offset@{}=45", "m2.torque_offset@{}=45"], TOGETHER),
    ],
)
def test_a_wrong_torque_ends_the_run_in_time(faults: list[str], named: str) -> None:
    rig = small_rig()
    specs = [each.format(FROM_S) for each in faults]
    seen: list[float] = []
    with served(rig, rig_faults(specs, rig.period_s)) as (server, at):
        with pytest.raises(WrongTorque, match=named):
            run_once(at, Samples(), progress=lambda phase, time_s: seen.append(server.plc.values()["plc_count"]))
        assert_disarmed(server.bus_url, 1, 2)
        assert server.torque_nm == (0.0, 0.0)
        assert float(server.plc.values()["plc_count"]) * rig.period_s <= FROM_S + NOTICED_S


def test_a_torque_nobody_asked_for_ends_it_before_the_guard_is_enabled() -> None:
    rig = small_rig()
    samples = Samples()
    with served(rig, rig_faults(["m1.torque_offset@0=800"], rig.period_s)) as (server, at):
        with pytest.raises(WrongTorque, match=r"inverter m1: .* is 480 Nm, expected"):
            run_once(at, samples)
        assert_disarmed(server.bus_url, 1, 2)
    assert samples.rows == []


@pytest.mark.parametrize(
    "fault", one_in(2, ["m1.weak_cooling=5", "m2.stale_share=0.3", "m1.coarse_torque=10", "m2.clock_drift=200"])
)
def test_what_a_healthy_drive_does_is_recorded(fault: str) -> None:
    """A drive that says it is limited, is slow, coarse, or samples by a clock of its own."""
    rig = small_rig()
    samples = Samples()
    with served(rig, rig_faults([fault], rig.period_s)) as (_, at):
        assert run_once(at, samples).recorded > 0
    if "weak" in fault:
        assert any(row.flags & SampleFlag.M1_LIMITED for row in samples.rows)
