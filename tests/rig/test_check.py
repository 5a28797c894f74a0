"""Looking for devices: each is found or not on its own, and nothing is armed."""

from __future__ import annotations

import pytest

from drivers.inverter.cia402 import PowerState
from drivers.plc.register_map import load_register_map
from drivers.resources import data_file
from hil.rig.check import Verdict, check_rig
from hil.simulator.fault_table import rig_faults
from hil.simulator.faults import FaultAtStep, InverterFaults, PlcFaults, RigFaults
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


def test_registers_of_the_plc_are_shown_in_their_units() -> None:
    with served() as (_, rig):
        plc = check_rig(rig)[-1]
    held = {each.name: (each.value, each.unit) for each in plc.registers}
    assert held["speed_limit"] == (320.0, "rad/s")
    assert held["torque_limit"] == (pytest.approx(400.0), "Nm")
    assert held["drive_mode"] == ("series", "")
    assert list(held) == list(load_register_map(data_file("plc.toml")).registers)


def test_floats_in_the_other_word_order_are_refused_with_what_they_would_be() -> None:
    with served(faults=RigFaults(plc=PlcFaults(swaps_floats=True))) as (_, rig):
        plc = check_rig(rig)[-1]
    assert plc.verdict is Verdict.DIFFERS
    [difference] = plc.differences
    assert difference.what == "speed_limit, input_register 6"
    assert difference.expected == "0, or 0.1 to 10000 rad/s"
    assert "With word_order = 'high_word_first' in the register map it would be 320 rad/s" in difference.found


@pytest.mark.parametrize("fault", ["wrong_unit", "wrong_transaction"])
def test_plc_that_answers_with_other_identifiers_is_reported_as_such(fault: str) -> None:
    with served(faults=rig_faults([f"plc.{fault}@0"], 0.01)) as (_, rig):
        plc = check_rig(rig)[-1]
    assert plc.verdict is Verdict.FAILED
    assert "expected an answer with transaction id 1, unit id 1, got transaction id" in plc.notes[0]


def test_drive_in_fault_is_a_note_not_a_difference() -> None:
    """It is the drive the rig file describes; but before the next run someone has to see to it."""
    faults = InverterFaults(fault=FaultAtStep(0, 0x4310))
    with served(faults=RigFaults(m2=faults)) as (server, rig):
        findings = {finding.device: finding for finding in check_rig(rig)}
        state = power_state(server.bus_url, 2)
    assert findings["m2"].verdict is Verdict.AGREES
    assert findings["m2"].notes == (
        "power state is fault, error code 0x603F is 0x4310 excess temperature of the drive, expected a drive without "
        "fault. Fix the cause at the drive, reset the fault.",
    )
    assert findings["m1"].notes == ()
    assert state is PowerState.FAULT


def test_vehicle_that_is_not_fit_is_a_note_not_a_fault() -> None:
    with served() as (server, rig):
        server.plc.close_clutch()
        plc = check_rig(rig)[-1]
    assert plc.verdict is Verdict.AGREES
    assert plc.notes == ("clutch is closed, expected open",)
