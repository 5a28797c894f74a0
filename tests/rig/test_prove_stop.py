"""``check_rig`` with the proof: both drives, one after the other, and nothing stays armed."""

from hil.rig.check import Verdict, check_rig
from hil.simulator.faults import InverterFaults, RigFaults
from tests.rig.observer import assert_disarmed
from tests.rig.serving import changed, served, small_rig

QUICK = {"inverters.m1": {"rpdo_deadline_ms": 50}, "inverters.m2": {"rpdo_deadline_ms": 50}}


def test_both_drives_prove_it_and_are_disabled_after_it() -> None:
    with served(changed(small_rig(), QUICK)) as (server, rig):
        findings = check_rig(rig, prove_stop=True)
        assert_disarmed(server.bus_url, 1, 2)
    assert {finding.verdict for finding in findings} == {Verdict.AGREES}


def test_a_drive_that_ignores_what_watches_its_host_fails_and_the_other_is_still_proved() -> None:
    faults = RigFaults(m1=InverterFaults(ignored_writes=frozenset({0x1016})))
    with served(changed(small_rig(), QUICK), faults) as (server, rig):
        findings = {finding.device: finding for finding in check_rig(rig, prove_stop=True)}
        assert_disarmed(server.bus_url, 1, 2)
    assert findings["m1"].verdict is Verdict.FAILED
    assert "object 0x1016:01 reads 0" in findings["m1"].notes[0]
    assert findings["m2"].verdict is Verdict.AGREES
