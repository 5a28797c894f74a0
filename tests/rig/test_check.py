"""Looking for devices: each is found or not on its own, and nothing is armed."""

from __future__ import annotations

import pytest

from drivers.inverter.cia402 import PowerState
from hil.rig.check import Verdict, check_rig
from hil.simulator.inverter_settings import FaultAtStep, InverterFaults
from hil.simulator.rig_server import RigFaults
from tests.rig.observer import power_state
from tests.rig.serving import changed, served


def test_rig_as_described_agrees_and_stays_as_it_is() -> None:
    with served() as (server, rig):
        findings = check_rig(rig)
        states = {power_state(server.bus_url, node_id) for node_id in (1, 2)}
    assert [finding.device for finding in findings] == ["can", "m1", "m2", "plc"]
    assert {finding.verdict for finding in findings} == {Verdict.AGREES}
    assert not any(finding.notes for finding in findings)
    assert states == {PowerState.SWITCH_ON_DISABLED}


@pytest.mark.parametrize(
    ("faults", "verdict"),
    [
        (InverterFaults(identity=(1, 2)), Verdict.DIFFERS),
        (InverterFaults(velocity_unit=0), Verdict.DIFFERS),
        (InverterFaults(absent=True), Verdict.FAILED),
        (InverterFaults(hang_at_step=0), Verdict.FAILED),
    ],
)
def test_wrong_inverter_is_found_and_the_rest_is_still_checked(faults: InverterFaults, verdict: Verdict) -> None:
    with served(faults=RigFaults(m1=faults)) as (_, rig):
        findings = {finding.device: finding for finding in check_rig(rig)}
    assert findings["m1"].verdict is verdict
    assert findings["m1"].differences or findings["m1"].notes
    assert findings["m2"].verdict is Verdict.AGREES
    assert findings["plc"].verdict is Verdict.AGREES


def test_missing_bus_is_one_fault_and_the_plc_is_still_checked() -> None:
    with served() as (_, rig):
        findings = check_rig(changed(rig, {"can": {"url": "ws://127.0.0.1:9/"}}))
    verdicts = [finding.verdict for finding in findings]
    assert verdicts == [Verdict.FAILED, Verdict.FAILED, Verdict.FAILED, Verdict.AGREES]
    assert "ws://127.0.0.1:9/" in findings[0].notes[0]
    assert findings[1].notes == ("its bus is not there",)


def test_missing_plc() -> None:
    with served() as (_, rig):
        findings = check_rig(changed(rig, {"plc": {"port": 9}}))
    assert [finding.verdict for finding in findings] == [*[Verdict.AGREES] * 3, Verdict.FAILED]


def test_drive_in_fault_is_a_note_not_a_difference() -> None:
    """It is the drive the rig file describes; but before the next run someone has to see to it."""
    faults = InverterFaults(fault=FaultAtStep(0, 0x4310))
    with served(faults=RigFaults(m2=faults)) as (server, rig):
        findings = {finding.device: finding for finding in check_rig(rig)}
        state = power_state(server.bus_url, 2)
    assert findings["m2"].verdict is Verdict.AGREES
    assert findings["m2"].notes == (
        "power state is fault, error code 0x603F is 0x4310 excess temperature of the drive, expected a drive without "
        "fault. Mend the cause at the drive, reset the fault.",
    )
    assert findings["m1"].notes == ()
    assert state is PowerState.FAULT


def test_vehicle_that_is_not_fit_is_a_note_not_a_fault() -> None:
    with served() as (server, rig):
        server.plc.close_clutch()
        plc = check_rig(rig)[-1]
    assert plc.verdict is Verdict.AGREES
    assert plc.notes == ("clutch is closed, expected open",)
