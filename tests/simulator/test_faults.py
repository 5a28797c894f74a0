"""Faults as a person writes them, and drives that misbehave without a fault: each as a real one would."""

from pathlib import Path

import pytest

from drivers.errors import ConfigMismatch
from drivers.inverter.cia402 import PowerState, PowerState as S, state_of
from hil.errors import UsageError
from hil.rig.build import open_devices
from hil.rig.check import check_rig
from hil.simulator.addresses import with_addresses
from hil.simulator.fault_table import DEVICES, NOBODY, OVERCURRENT, known_faults, rig_faults
from hil.simulator.faults import (
    AtStep,
    BusFaults,
    DriveLimits,
    Frames,
    InverterFaults,
    PlcAnswers,
    PlcFaults,
    RigFaults,
    WrongSpeed,
    WrongTorque,
)
from hil.simulator.rig_server import RigServer
from tests.drivers.can_bench import M1, Bench, bench, guarded
from tests.rig.serving import ANY_PORT, changed, small_rig
from tests.simulator.rigid_plant import RigidPlant

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
        ("m1.fault@0.07", RigFaults(m1=InverterFaults(fault=AtStep(7, OVERCURRENT)))),
        ("plc.clutch_closes@5", RigFaults(plc=PlcFaults(clutch_closes_at_s=5.0))),
        ("plc.permissive_withdrawn@5", RigFaults(plc=PlcFaults(permissive_withdrawn_at_s=5.0))),
        ("plc.mode_changes@5", RigFaults(plc=PlcFaults(mode_changes_at_s=5.0))),
        ("m1.fault@0.07=0x3210", RigFaults(m1=InverterFaults(fault=AtStep(7, 0x3210)))),
        ("m1.emcy@0.07=33072", RigFaults(m1=InverterFaults(emcy=AtStep(7, 0x8130)))),
        ("m2.reset@1", RigFaults(m2=InverterFaults(reset_at_step=100))),
        ("m2.bus_off@1", RigFaults(m2=InverterFaults(bus_off_at_step=100))),
        ("m2.stale_pdo@1", RigFaults(m2=InverterFaults(stale_from_step=100))),
        ("m2.stale_share=0.1", RigFaults(m2=InverterFaults(stale_share=0.1))),
        ("m2.brown_out@1", RigFaults(m2=InverterFaults(brown_out_at_step=100))),
        ("m1.clock_drift=-200", RigFaults(m1=InverterFaults(clock_drift_ppm=-200.0))),
        ("m1.forgets=0x1A00", RigFaults(m1=InverterFaults(ignored_writes=frozenset({0x1A00})))),
        ("m1.lacks=0x6072", RigFaults(m1=InverterFaults(missing_objects=frozenset({0x6072})))),
        ("m1.locks=0x1600", RigFaults(m1=InverterFaults(locked_objects=frozenset({0x1600})))),
        ("m1.field_weakening=90", RigFaults(m1=InverterFaults(limits=DriveLimits(base_speed_rad_s=90.0)))),
        ("m1.weak_cooling=500", RigFaults(m1=InverterFaults(limits=DriveLimits(continuous_permille=500.0)))),
        ("m1.coarse_torque=5", RigFaults(m1=InverterFaults(limits=DriveLimits(torque_step_permille=5)))),
        ("bus.lose=0.01", RigFaults(bus=BusFaults(lose=AtStep(0, Frames(0.01))))),
        ("bus.corrupt@1=1:0x181", RigFaults(bus=BusFaults(corrupt=AtStep(100, Frames(1.0, 0x181))))),
        ("bus.repeat=0.5", RigFaults(bus=BusFaults(repeat=AtStep(0, Frames(0.5))))),
        ("bus.reorder=0.5:0", RigFaults(bus=BusFaults(reorder=AtStep(0, Frames(0.5, 0))))),
        ("bus.delay@2=0.003", RigFaults(bus=BusFaults(delay=AtStep(200, Frames(0.003))))),
        ("bus.jitter=0.001", RigFaults(bus=BusFaults(jitter=AtStep(0, Frames(0.001))))),
        ("bus.off@1", RigFaults(bus=BusFaults(off_at_step=100))),
        ("m1.torque_gain@1=-1", RigFaults(m1=InverterFaults(wrong_torque=WrongTorque(100, gain=-1.0)))),
        ("m1.leaves_operation@1", RigFaults(m1=InverterFaults(leaves_operation=AtStep(100, S.SWITCHED_ON)))),
        (
            "m1.leaves_operation@1=quick_stop",
            RigFaults(m1=InverterFaults(leaves_operation=AtStep(100, S.QUICK_STOP_ACTIVE))),
        ),
        ("m2.speed_gain@1=-1", RigFaults(m2=InverterFaults(wrong_speed=WrongSpeed(100, -1.0)))),
        ("m2.speed_stuck@1", RigFaults(m2=InverterFaults(wrong_speed=WrongSpeed(stuck_from_step=100)))),
        ("m1.second_tpdo@1=2", RigFaults(m1=InverterFaults(second_tpdo=AtStep(100, 2)))),
        ("bus.swapped_nodes", RigFaults(bus=BusFaults(swapped_nodes=True))),
        (" plc.hang@1e1 ", RigFaults(plc=PlcFaults(answers_at_s=frozenset({(10.0, PlcAnswers.NOT)})))),
    ],
)
def test_each_fault_is_put_into_its_device(text: str, faults: RigFaults) -> None:
    assert rig_faults([text], PERIOD_S) == faults


@pytest.mark.parametrize(
    "text", ["", "m1", "m3.absent", "m1.clutch_closes@1", "plc.absent", "m1.absent.now", "m1:absent"]
)
def test_what_is_not_known_is_refused_with_what_is(text: str) -> None:
    with pytest.raises(UsageError) as refusal:
        rig_faults([text], PERIOD_S)
    assert str(refusal.value) == f"fault {text!r}: expected one of {known_faults()}."


def test_the_list_has_every_fault_as_it_is_written() -> None:
    listed = known_faults()
    for device, kinds in DEVICES.items():
        for name, kind in kinds.items():
            assert kind.written(name) in listed, f"{device}.{name}"
    for written in ("absent,", "hang@S,", "fault@S[=CODE],", "emcy@S=CODE,", "lose[@S]=SHARE[:ID],", "lacks=INDEX,"):
        assert written in listed


def test_the_page_of_the_simulated_drives_has_every_fault() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "supported-protocols.md").read_text(encoding="utf-8")
    for device in ("m1", "bus"):
        for name, kind in DEVICES[device].items():
            assert f"`{kind.written(name)}`" in page, f"{device}.{name}"


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["m1.absent@2"], "expected no moment, got '2'"),
        (["m1.hang"], r"expected a moment in seconds, got none. Write m1.hang@5.0"),
        (["m1.hang@soon"], "expected seconds of simulated time, 0 or more, got 'soon'"),
        (["m1.hang@-1"], "0 or more, got '-1'"),
        (["m1.hang@nan"], "0 or more, got 'nan'"),
        (["m1.hang@inf"], "0 or more, got 'inf'"),
        (["m1.hang@1", "m1.hang@2"], "expected m1.hang once, got twice"),
        (["m1.lacks=0x6072", "m1.lacks=24690"], "expected m1.lacks once, got twice"),
        (["bus.lose=0.1", "bus.lose=0.2"], "expected bus.lose once, got twice"),
        (["m1.emcy@1"], r"expected an error code, 0x1000 to 0xFFFF, got none. Write m1.emcy@S=CODE"),
        (["m1.emcy@1=0"], "expected an error code, 0x1000 to 0xFFFF, got '0'"),
        (["m1.emcy@1=soon"], "expected an error code, .* got 'soon'"),
        (["m1.hang@1=2"], "expected nothing after its name, got '=2'"),
        (["m1.leaves_operation@1=fault"], "expected a state: ready, switched_on, quick_stop, disabled, got 'fault'"),
        (["m1.second_tpdo@1=0"], "expected a whole number from 1 to 1000"),
        (["m1.lacks"], "expected an object, 0x1000 to 0xFFFF, got none. Write m1.lacks=INDEX"),
        (["m1.lacks=0x12345"], "expected an object"),
        (["m1.clock_drift=nan"], "expected a number from -100000 to 100000 parts per million, got 'nan'"),
        (["m1.coarse_torque=0"], "expected a number from 1 to 100 of rated torque, got '0'"),
        (["bus.lose=1.5"], "expected a number from 0 to 1 of all, and :ID .*, got '1.5'"),
        (["bus.lose=0.5:0x800"], "got '0.5:0x800'"),
        (["bus.lose=0.5:"], "got '0.5:'"),
        (["bus.delay=-1"], "expected a number from 0 to 10 s"),
        (["bus.off"], "expected a moment in seconds, got none"),
    ],
)
def test_a_moment_too_many_or_too_few_is_refused(texts: list[str], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        rig_faults(texts, PERIOD_S)


def m1(*texts: str) -> InverterFaults:
    return rig_faults([f"m1.{text}" for text in texts], PERIOD_S).m1


def armed(rig: Bench) -> Bench:
    for inverter in (rig.m1, rig.m2):
        inverter.configure()
        inverter.arm()
    return rig


@pytest.mark.parametrize(
    ("word", "state"),
    [
        ("ready", PowerState.READY_TO_SWITCH_ON),
        ("switched_on", PowerState.SWITCHED_ON),
        ("quick_stop", PowerState.QUICK_STOP_ACTIVE),
        ("disabled", PowerState.SWITCH_ON_DISABLED),
    ],
)
def test_a_drive_leaves_operation_by_itself_without_a_word(word: str, state: PowerState) -> None:
    """Once, in the third SYNC with torque; no EMCY, no fault, no torque."""
    emergencies: list[bytes] = []
    with bench(m1(f"leaves_operation@0.03={word}")) as rig:
        rig.link.subscribe(0x080 + M1.node_id, lambda data, t_ns: emergencies.append(data))
        armed(rig)
        for _ in range(2):
            assert rig.cycle(guarded(60.0)).state is PowerState.OPERATION_ENABLED
        rig.link.sync()
        assert state_of(rig.m1._sdo.upload(0x6041)) is state
        assert rig.rig.torque_nm[0] == 0.0
    assert emergencies == []


def speeds(faults: InverterFaults, syncs: int) -> list[float]:
    """What m1 reads of a shaft that accelerates evenly."""
    with bench(faults, plant=RigidPlant(1.0, 0.01)) as rig:
        armed(rig)
        return [rig.cycle(guarded(100.0)).speed_rad_s for _ in range(syncs)]


def test_a_speed_turned_halved_or_stuck_from_a_moment_on() -> None:
    true = speeds(InverterFaults(), 6)
    assert true[-1] > 3.0
    for factor in (-1.0, 0.5, 0.0):
        wrong = speeds(m1(f"speed_gain@0.04={factor}"), 6)
        assert wrong[:3] == pytest.approx(true[:3], abs=0.3)
        assert wrong[3:] == pytest.approx([factor * speed for speed in true[3:]], abs=0.3)
    stuck = speeds(m1("speed_stuck@0.04"), 6)
    assert stuck[:3] == pytest.approx(true[:3], abs=0.3)
    assert stuck[3:] == [stuck[2]] * 3


def test_swapped_node_ids_are_found_by_the_serial_numbers() -> None:
    rig = changed(small_rig(), {f"inverters.m{number}": {"serial_number": number} for number in (1, 2)})
    swapped = rig_faults(("bus.swapped_nodes",), rig.period_s)
    with RigServer(RigidPlant(1.0, 0.01), rig, "virtual:swapped", ANY_PORT, swapped) as server:
        at = with_addresses(rig, server.bus_url, str(server.modbus))
        with open_devices(at) as devices, pytest.raises(ConfigMismatch, match="0x1018:04 is 2: another drive"):
            devices.m1.configure()
        found = [str(each) for finding in check_rig(at) for each in finding.differences]
    assert [text for text in found if "serial" in text] == [
        "inverter m1 (node 1): serial number 0x1018:04 is 2: another drive has this node id, expected 1 (rig file)",
        "inverter m2 (node 2): serial number 0x1018:04 is 1: another drive has this node id, expected 2 (rig file)",
    ]
