"""`hil check`: the rig as described, the proof that the drives stop, and what somebody has accepted."""

import re
from pathlib import Path

import pytest

from drivers.errors import ConfigMismatch
from drivers.inverter.cia402 import PowerState
from drivers.inverter.settings import Acceptance
from drivers.plc.types import ClutchState
from drivers.resources import data_file
from hil.rig.check import DeviceVerdict, check_rig
from hil.simulator.addresses import is_simulated_bus
from hil.simulator.fault_table import rig_faults
from hil.simulator.faults import InverterFaults, RigFaults
from tests.rig.observer import assert_disarmed, power_state
from tests.rig.serving import Samples, changed, run_once, served, small_rig


def test_rig_as_described_agrees_and_stays_as_it_is() -> None:
    with served() as (server, rig):
        findings = check_rig(rig)
        states = {power_state(server.bus_url, node_id) for node_id in (1, 2)}
    assert [finding.device for finding in findings] == ["can", "m1", "m2", "plc"]
    assert {finding.verdict for finding in findings} == {DeviceVerdict.AGREES}
    assert not any(finding.notes for finding in findings)
    assert states == {PowerState.SWITCH_ON_DISABLED}


def test_cob_ids_that_both_drives_would_use_are_named_before_anything_is_armed(tmp_path: Path) -> None:
    """m1 has the TPDO that m2 is to get: until m1 is set up too both send under one identifier."""
    path = tmp_path / "m1.eds"
    path.write_text(data_file("inverter.eds").read_text("utf-8").replace("$NODEID+0x180", "0x182"), "utf-8")
    with served(changed(small_rig(), {"inverters.m1": {"eds": path}})) as (server, rig):
        m2 = check_rig(rig)[2]
        with pytest.raises(ConfigMismatch, match=r"COB-ID of its TPDO 0x1800 is 0x182, which m1 uses for its TPDO"):
            run_once(rig, Samples())
        assert_disarmed(server.bus_url, 1, 2)
    assert m2.verdict is DeviceVerdict.DIFFERS
    assert "0x182, which m1 uses" in str(m2.differences[-1])


@pytest.mark.parametrize(
    ("cob_id", "device", "said"),
    [
        (
            0x201,
            "m1",
            "inverter m1 (node 1): COB-ID of its RPDO 0x1400 is 0x201, which the PLC's gateway uses for its messages",
        ),
        (0x582, "m2", "inverter m2 (node 2): COB-ID of its SDO answer is 0x582, which the PLC's gateway uses"),
        (0x080, "can", "plc: COB-ID of its messages is 0x080, which this program uses for its SYNC"),
    ],
)
def test_a_cob_id_of_the_plc_s_gateway_that_is_used_is_named_before_anything_is_armed(
    cob_id: int, device: str, said: str
) -> None:
    with served(changed(small_rig(), {"plc": {"cob_ids": (0x3A0, cob_id)}})) as (server, rig):
        found = {each.device: each for each in check_rig(rig)}
        with pytest.raises(ConfigMismatch, match=re.escape(said)):
            run_once(rig, Samples())
        assert_disarmed(server.bus_url, 1, 2)
    assert str(found[device].differences[0]).startswith(said)
    assert {name for name, each in found.items() if each.verdict is DeviceVerdict.DIFFERS} == {device}


def test_missing_bus_is_one_fault_and_the_plc_is_still_checked() -> None:
    with served() as (_, rig):
        findings = check_rig(changed(rig, {"can": {"url": "ws://127.0.0.1:9/"}}))
    verdicts = [finding.verdict for finding in findings]
    assert verdicts == [DeviceVerdict.FAILED, DeviceVerdict.FAILED, DeviceVerdict.FAILED, DeviceVerdict.AGREES]
    assert "ws://127.0.0.1:9/" in findings[0].notes[0]
    assert findings[1].notes == ("its bus is not there",)


@pytest.mark.parametrize("fault", ["wrong_unit", "wrong_transaction"])
def test_plc_that_answers_with_other_identifiers_is_reported_as_such(fault: str) -> None:
    with served(faults=rig_faults([f"plc.{fault}@0"], 0.01)) as (_, rig):
        plc = check_rig(rig)[-1]
    assert plc.verdict is DeviceVerdict.FAILED
    assert "expected an answer with transaction id 1, unit id 1, got transaction id" in plc.notes[0]


def test_vehicle_that_is_not_fit_is_a_note_not_a_fault() -> None:
    with served() as (server, rig):
        server.plc._clutch = ClutchState.CLOSED
        plc = check_rig(rig)[-1]
    assert plc.verdict is DeviceVerdict.AGREES
    assert plc.notes == ("clutch is closed, expected open",)


QUICK = {"inverters.m1": {"rpdo_deadline_ms": 50}, "inverters.m2": {"rpdo_deadline_ms": 50}}


def test_both_drives_prove_it_and_are_disabled_after_it() -> None:
    with served(changed(small_rig(), QUICK)) as (server, rig):
        findings = check_rig(rig, prove_stop=True)
        assert_disarmed(server.bus_url, 1, 2)
    assert {finding.verdict for finding in findings} == {DeviceVerdict.AGREES}
    assert [finding.dead_cycles is not None for finding in findings] == [False, True, True, False]


def test_a_drive_that_ignores_what_watches_its_host_fails_and_the_other_is_still_proved() -> None:
    faults = RigFaults(m1=InverterFaults(ignored_writes=frozenset({0x1016})))
    with served(changed(small_rig(), QUICK), faults) as (server, rig):
        findings = {finding.device: finding for finding in check_rig(rig, prove_stop=True)}
        assert_disarmed(server.bus_url, 1, 2)
    assert findings["m1"].verdict is DeviceVerdict.FAILED
    assert "object 0x1016:01 reads 0" in findings["m1"].notes[0]
    assert findings["m2"].verdict is DeviceVerdict.AGREES


FILLED_IN = ("A. Nyone", "a relay of its own")


@pytest.mark.parametrize(
    ("by", "why"),
    [("NAME", FILLED_IN[1]), (FILLED_IN[0], "REASON"), (FILLED_IN[0], " ... "), ("<name>", FILLED_IN[1]), (" ", "-")],
)
def test_a_line_that_was_only_pasted_is_nobodys_acceptance(by: str, why: str) -> None:
    assert not Acceptance(by, why).is_by_a_person
    assert Acceptance(*FILLED_IN).is_by_a_person


@pytest.mark.parametrize(
    ("url", "simulated"),
    [
        ("virtual:a", True),
        ("socketcan:vcan0", True),
        ("ws://127.0.0.1:54701/token/", True),
        ("ws://[::1]:1/", True),
        ("socketcan:can0", False),
        ("ws://10.0.0.7:1/", False),
        ("ws://vehicle:1/", False),
        ("ws://:x/", False),
    ],
)
def test_where_drives_are_simulated(url: str, simulated: bool) -> None:
    assert is_simulated_bus(url) is simulated
