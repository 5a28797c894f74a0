"""Looking for devices: each is found or not on its own, and nothing is armed."""

import pytest

from drivers.inverter.cia402 import PowerState
from hil.rig.check import Verdict, check_rig
from hil.simulator.fault_table import rig_faults
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


def test_missing_bus_is_one_fault_and_the_plc_is_still_checked() -> None:
    with served() as (_, rig):
        findings = check_rig(changed(rig, {"can": {"url": "ws://127.0.0.1:9/"}}))
    verdicts = [finding.verdict for finding in findings]
    assert verdicts == [Verdict.FAILED, Verdict.FAILED, Verdict.FAILED, Verdict.AGREES]
    assert "ws://127.0.0.1:9/" in findings[0].notes[0]
    assert findings[1].notes == ("its bus is not there",)


@pytest.mark.parametrize("fault", ["wrong_unit", "wrong_transaction"])
def test_plc_that_answers_with_other_identifiers_is_reported_as_such(fault: str) -> None:
    with served(faults=rig_faults([f"plc.{fault}@0"], 0.01)) as (_, rig):
        plc = check_rig(rig)[-1]
    assert plc.verdict is Verdict.FAILED
    assert "expected an answer with transaction id 1, unit id 1, got transaction id" in plc.notes[0]


def test_vehicle_that_is_not_fit_is_a_note_not_a_fault() -> None:
    with served() as (server, rig):
        server.plc.close_clutch()
        plc = check_rig(rig)[-1]
    assert plc.verdict is Verdict.AGREES
    assert plc.notes == ("clutch is closed, expected open",)
