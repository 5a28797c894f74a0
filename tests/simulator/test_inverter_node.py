"""The simulated inverter on the bus: NMT, PDO configuration, EMCY, heartbeat, by frames."""

from collections.abc import Iterator
from contextlib import suppress

import can
import pytest

from drivers.canopen.heartbeat import NMT_COB_ID, NmtCommand, nmt_frame
from drivers.canopen.sdo import SdoChannel
from drivers.errors import ConfigMismatch, DeviceTimeout, ProtocolViolation
from tests.drivers.can_bench import M1, Bench, bench, frame, guarded


@pytest.fixture
def armed() -> Iterator[Bench]:
    with bench() as rig:
        for inverter in (rig.m1, rig.m2):
            inverter.configure()
        rig.m1.arm()
        rig.cycle(guarded(120.0))
        yield rig


def answers(rig: Bench, syncs: int) -> int:
    """How many TPDOs of m1 so many SYNCs bring; m2 answers after m1 and so ends the waiting."""
    counted: list[bytes] = []
    rig.link.subscribe(0x180 + M1.node_id, lambda data, t_ns: counted.append(data))
    for _ in range(syncs):
        if rig.m2.await_feedback(rig.link.sync(), timeout_s=5.0) is None:
            raise AssertionError("no feedback of m2 in 5 s")
    return len(counted)


def objects(rig: Bench) -> SdoChannel:
    return rig.m1._sdo


def nmt(rig: Bench, command: NmtCommand, node_id: int = M1.node_id) -> None:
    rig.link.send(NMT_COB_ID, nmt_frame(command, node_id))


def received(bus: can.BusABC, cob_id: int) -> bytes:
    """Next frame with an identifier."""
    while (message := bus.recv(5.0)) is not None:
        if message.arbitration_id == cob_id:
            return bytes(message.data)
    raise AssertionError(f"no frame 0x{cob_id:03X} in 5 s")


@pytest.mark.parametrize("node_id", [M1.node_id, 0])
@pytest.mark.parametrize("command", [command for command in NmtCommand if command is not NmtCommand.START])
def test_leaving_nmt_operational_takes_the_torque_away(armed: Bench, command: NmtCommand, node_id: int) -> None:
    assert armed.rig.torque_nm[0] == pytest.approx(120.0)
    nmt(armed, command, node_id)
    armed.m2.configure()  # where all nodes were meant, m2 too was stopped
    assert answers(armed, syncs=1) == 0
    assert armed.rig.torque_nm[0] == 0.0


@pytest.mark.parametrize("data", [nmt_frame(NmtCommand.STOP, 99), b"", b"\x02", b"\x50\x05", b"\x02\x05\x00"])
def test_nmt_for_others_or_of_no_sense_changes_nothing(armed: Bench, data: bytes) -> None:
    with armed.intruder() as bus:
        bus.send(frame(NMT_COB_ID, data))
    with suppress(ProtocolViolation):  # the host says once that it can't read a frame that is too short
        armed.link.raise_if_failed()
    assert armed.m1.await_feedback(armed.link.sync(), timeout_s=5.0) is not None
    assert armed.rig.torque_nm[0] == pytest.approx(120.0)


def test_stopped_node_answers_no_sdo(armed: Bench) -> None:
    nmt(armed, NmtCommand.STOP)
    client = objects(armed)._client
    client.RESPONSE_TIMEOUT = 0.02
    with pytest.raises(DeviceTimeout):
        objects(armed).upload(0x6041)
    client.RESPONSE_TIMEOUT = M1.sdo_timeout_s
    nmt(armed, NmtCommand.ENTER_PRE_OPERATIONAL)
    objects(armed).upload(0x6041)


def test_reset_node_boots_with_the_values_of_its_eds(armed: Bench) -> None:
    objects(armed).download(0x6007, 0, 0)
    with armed.intruder() as bus:
        nmt(armed, NmtCommand.RESET_NODE)
        while received(bus, 0x700 + M1.node_id) != b"\x00":  # a heartbeat may be on its way
            pass
        assert objects(armed).upload(0x6007) == 2
        assert objects(armed).upload(0x1017) == 0
        assert objects(armed).upload(0x6071) == 0


@pytest.mark.parametrize(
    ("index", "subindex", "value", "reason"),
    [
        (0x1A00, 0, 2, "0x08000022"),  # while the PDO is on
        (0x1A00, 1, 0x60770010, "0x08000022"),
        (0x1800, 1, 0x285, "0x06090030"),  # another identifier
        (0x1800, 2, 241, "0x06090030"),  # reserved
        (0x1400, 2, 252, "0x06090030"),  # at a remote frame
    ],
)
def test_pdo_that_is_on_is_not_changed(index: int, subindex: int, value: int, reason: str) -> None:
    with bench() as rig, pytest.raises(ConfigMismatch, match=reason):
        objects(rig).download(index, subindex, value)


@pytest.mark.parametrize("permille", [1001, 32767, -32768])
def test_rpdo_beyond_max_torque_is_not_taken_and_said_in_the_statusword(armed: Bench, permille: int) -> None:
    with armed.intruder() as bus:
        bus.send(frame(0x205, b"\x0f\x00" + permille.to_bytes(2, "little", signed=True) + bytes(2)))
        assert armed.m1.await_feedback(armed.link.sync(), timeout_s=5.0) is not None
    assert armed.rig.torque_nm[0] == pytest.approx(120.0)
    assert objects(armed).upload(0x6041) & 1 << 11


@pytest.mark.parametrize("length", range(8))
def test_an_sdo_frame_that_is_too_short_is_passed_over(armed: Bench, length: int) -> None:
    """One of length 0 ended the simulated bus."""
    with armed.intruder() as bus:
        bus.send(frame(0x600 + M1.node_id, b"\x40\x41\x60\x00\x00\x00\x00\x00"[:length]))
    with suppress(ProtocolViolation):
        armed.link.raise_if_failed()
    assert objects(armed).upload(0x6040) == 0x000F
    assert armed.m1.await_feedback(armed.link.sync(), timeout_s=5.0) is not None
    assert armed.rig.torque_nm[0] == pytest.approx(120.0)


@pytest.mark.parametrize("cob_id", [0x080 + M1.node_id, 0x180 + M1.node_id, 0x200 + M1.node_id, 0x580 + M1.node_id,
                                    0x600 + M1.node_id, 0x700 + M1.node_id, 0x77F, 0x7E5, 0x000])  # fmt: skip
def test_an_empty_frame_of_any_service_ends_nothing(armed: Bench, cob_id: int) -> None:
    with armed.intruder() as bus:
        bus.send(frame(cob_id, b""))
    with suppress(ProtocolViolation):
        armed.link.raise_if_failed()
    armed.cycle(guarded(120.0))
    assert armed.rig.torque_nm[0] == pytest.approx(120.0)
