"""Faults as a person writes them: each is put into its device, and nothing else passes."""

from __future__ import annotations

import pytest

from drivers.plc_types import ClutchState, DriveMode
from hil.errors import UsageError
from hil.simulator.fault_spec import DEVICES, NOBODY, OVERCURRENT, known_faults, rig_faults
from hil.simulator.inverter_settings import FaultAtStep, InverterFaults
from hil.simulator.plc_device import PlcDevice, PlcFaults
from hil.simulator.rig_server import RigFaults

PERIOD_S = 0.01


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("m1.absent", RigFaults(m1=InverterFaults(absent=True))),
        ("m2.wrong_identity", RigFaults(m2=InverterFaults(identity=NOBODY))),
        ("m1.refuse_mode", RigFaults(m1=InverterFaults(ignored_writes=frozenset({0x6060})))),
        ("m1.stuck", RigFaults(m1=InverterFaults(ignored_writes=frozenset({0x6040})))),
        ("m2.hang@5.0", RigFaults(m2=InverterFaults(hang_at_step=500))),
        ("m2.hang@0", RigFaults(m2=InverterFaults(hang_at_step=0))),
        ("m1.fault@0.07", RigFaults(m1=InverterFaults(fault=FaultAtStep(7, OVERCURRENT)))),
        ("plc.clutch_closes@5", RigFaults(plc=PlcFaults(clutch_closes_at_s=5.0))),
        ("plc.permissive_withdrawn@5", RigFaults(plc=PlcFaults(permissive_withdrawn_at_s=5.0))),
        ("plc.mode_changes@5", RigFaults(plc=PlcFaults(mode_changes_at_s=5.0))),
        (" plc.hang@1e1 ", RigFaults(plc=PlcFaults(hangs_at_s=10.0))),
    ],
)
def test_each_fault_is_put_into_its_device(text: str, faults: RigFaults) -> None:
    assert rig_faults([text], PERIOD_S) == faults


def test_several_add_up() -> None:
    faults = rig_faults(["m1.refuse_mode", "m1.stuck", "plc.clutch_closes@1", "m2.absent"], PERIOD_S)
    assert faults == RigFaults(
        m1=InverterFaults(ignored_writes=frozenset({0x6040, 0x6060})),
        m2=InverterFaults(absent=True),
        plc=PlcFaults(clutch_closes_at_s=1.0),
    )


def test_none_is_no_fault() -> None:
    assert rig_faults([], PERIOD_S) == RigFaults()


@pytest.mark.parametrize(
    "text", ["", "m1", "m3.absent", "m1.clutch_closes@1", "plc.absent", "m1.absent.now", "m1:absent"]
)
def test_what_is_not_known_is_refused_with_what_is(text: str) -> None:
    with pytest.raises(UsageError) as refusal:
        rig_faults([text], PERIOD_S)
    assert str(refusal.value) == f"fault {text!r}: expected one of {known_faults()}."


def test_the_list_has_every_fault() -> None:
    assert all(kind in known_faults() for kinds in DEVICES.values() for kind in kinds)


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["m1.absent@2"], "expected no moment, came '2'"),
        (["m1.hang"], r"expected a moment in seconds, came none. Write m1.hang@5.0"),
        (["m1.hang@soon"], "expected seconds of simulated time, 0 or more, came 'soon'"),
        (["m1.hang@-1"], "0 or more, came '-1'"),
        (["m1.hang@nan"], "0 or more, came 'nan'"),
        (["m1.hang@inf"], "0 or more, came 'inf'"),
        (["m1.hang@1", "m1.hang@2"], "expected m1.hang once, came twice"),
    ],
)
def test_a_moment_too_many_or_too_few_is_refused(texts: list[str], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        rig_faults(texts, PERIOD_S)


def test_a_plc_may_be_unfit_from_the_start() -> None:
    device = PlcDevice(faults=PlcFaults(clutch_closes_at_s=0.0, permissive_withdrawn_at_s=0.0))
    assert device.clutch is ClutchState.CLOSED
    assert device.values()["permissive"] is False


def test_the_driver_changes_the_mode() -> None:
    device = PlcDevice(faults=PlcFaults(mode_changes_at_s=0.5))
    device.step(0.49)
    assert device.values()["drive_mode"] == DriveMode.SERIES.value
    device.step(0.01)
    assert device.values()["drive_mode"] == DriveMode.ELECTRIC.value
