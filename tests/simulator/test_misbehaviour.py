"""Drives that misbehave without a fault: each is seen on the wire as a real one would be."""

from __future__ import annotations

import pytest

from drivers.inverter.cia402 import PowerState, state_of
from hil.simulator.fault_table import rig_faults
from hil.simulator.faults import InverterFaults
from hil.simulator.plant import RigidPlant
from hil.simulator.rig_server import RigServer
from tests.drivers.can_bench import M1, Bench, bench, guarded
from tests.rig.observer import read_object
from tests.rig.serving import ANY_PORT, small_rig

PERIOD_S = 0.01


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


@pytest.mark.parametrize(("every", "expected"), [(1, 6), (2, 5)])
def test_a_second_tpdo_with_no_speed(every: int, expected: int) -> None:
    """Four SYNCs, and from the third on, or at the fourth alone, one frame more."""
    frames: list[bytes] = []
    with bench(m1(f"second_tpdo@0.03={every}"), plant=RigidPlant(1.0, 0.01)) as rig:
        armed(rig)
        rig.link.subscribe(0x180 + M1.node_id, lambda data, t_ns: frames.append(data))
        for _ in range(4):
            rig.cycle(guarded(100.0))
            rig.m1._sdo.upload(0x6041)  # answered after every TPDO of this SYNC
    assert len(frames) == expected
    assert frames[-1] != frames[-2]
    assert [a for a, b in zip(frames[-1], frames[-2], strict=True) if a != b] == [0] * sum(
        a != b for a, b in zip(frames[-1], frames[-2], strict=True)
    )


def test_swapped_node_ids_go_with_the_drive_and_not_with_its_number() -> None:
    """The drive behind m1 has serial number 1, wherever its node id is."""
    rig = small_rig()
    for texts, serials in (((), [1, 2]), (("bus.swapped_nodes",), [2, 1])):
        with RigServer(
            RigidPlant(1.0, 0.01), rig, "virtual:swapped", ANY_PORT, rig_faults(texts, rig.period_s)
        ) as server:
            nodes = (rig.inverters.m1.node_id, rig.inverters.m2.node_id)
            assert [read_object(server.bus_url, node_id, 0x1018, 4) for node_id in nodes] == serials
