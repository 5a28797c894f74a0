"""Heartbeats: their loss, by times passed in, and their sending."""

import threading

import pytest

from drivers.canopen.heartbeat import (
    HEARTBEAT_COB_ID,
    HOST_NODE_ID,
    NMT_COB_ID,
    HeartbeatMonitor,
    HeartbeatProducer,
    NmtCommand,
    NmtState,
    nmt_frame,
)
from drivers.canopen.node_monitor import NodeMonitor
from drivers.canopen.silence import GRACE_NS
from drivers.errors import BusDown, DeviceFault, DeviceTimeout, ProtocolViolation

MS = 1_000_000


def test_node_that_never_comes_is_lost_after_the_timeout() -> None:
    monitor = HeartbeatMonitor("node 5", timeout_ns=100 * MS, started_ns=1000 * MS)
    monitor.raise_if_lost(1100 * MS)
    monitor.raise_if_lost(1100 * MS + 1)
    with pytest.raises(DeviceTimeout, match="node 5: last heartbeat never, expected one every 100 ms"):
        monitor.raise_if_lost(1100 * MS + 1 + GRACE_NS)


def test_node_that_stops_is_lost_after_the_timeout_and_found_again() -> None:
    monitor = HeartbeatMonitor("node 5", timeout_ns=100 * MS, started_ns=0)
    monitor.beat(NmtState.OPERATIONAL, 250 * MS)
    monitor.raise_if_lost(350 * MS)
    monitor.raise_if_lost(351 * MS)
    with pytest.raises(DeviceTimeout, match="last heartbeat 201 ms ago, in OPERATIONAL"):
        monitor.raise_if_lost(351 * MS + GRACE_NS)
    monitor.beat(NmtState.OPERATIONAL, 452 * MS)
    monitor.raise_if_lost(552 * MS)


def test_listener_that_stood_still_itself_reads_what_came_meanwhile_before_it_judges() -> None:
    monitor = HeartbeatMonitor("node 5", timeout_ns=100 * MS, started_ns=0)
    for stood_still_ns in (1000 * MS, 3000 * MS):
        monitor.raise_if_lost(stood_still_ns)
        monitor.beat(NmtState.OPERATIONAL, stood_still_ns + 20 * MS)
        monitor.raise_if_lost(stood_still_ns + GRACE_NS)


def test_producer_sends_the_present_state_and_nothing_after_stop() -> None:
    sent: list[tuple[int, bytes]] = []
    enough = threading.Event()

    def send(cob_id: int, data: bytes) -> None:
        sent.append((cob_id, data))
        if len(sent) == 3:
            enough.set()

    states = iter([NmtState.PRE_OPERATIONAL, *[NmtState.OPERATIONAL] * 10_000])
    producer = HeartbeatProducer(send, 5, 0.001, lambda: next(states))
    assert enough.wait(60.0)
    producer.stop()
    count = len(sent)
    assert sent[:3] == [(0x705, b"\x7f"), (0x705, b"\x05"), (0x705, b"\x05")]
    assert not producer._thread.is_alive()
    assert len(sent) == count


def test_producer_ends_with_its_bus() -> None:
    def send(cob_id: int, data: bytes) -> None:
        raise BusDown("gone")

    producer = HeartbeatProducer(send, 5, 60.0, lambda: NmtState.OPERATIONAL)
    producer._thread.join(60.0)
    assert not producer._thread.is_alive()
    producer.stop()


def test_nmt_frame_is_command_and_node() -> None:
    assert nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL, 5) == b"\x80\x05"


def node_monitor(timeout_ms: int = 1_000_000) -> NodeMonitor:
    return NodeMonitor("node 5", timeout_ms * MS)


@pytest.mark.parametrize("data", [b"", b"\x05\x05", b"\x06"])
def test_heartbeat_of_no_known_state_is_refused(data: bytes) -> None:
    with pytest.raises(ProtocolViolation, match=r"node 5: heartbeat \[.*expected one byte"):
        node_monitor().on_heartbeat(data, 0)


def test_node_that_left_its_nmt_state_is_a_fault() -> None:
    monitor = node_monitor()
    monitor.expect(NmtState.OPERATIONAL)
    with pytest.raises(DeviceFault, match="NMT state is nothing so far, expected OPERATIONAL"):
        monitor.raise_if_unwell(0)
    monitor.on_heartbeat(b"\x05", 0)
    monitor.raise_if_unwell(0)
    monitor.on_heartbeat(b"\x00", 0)
    with pytest.raises(DeviceFault, match="NMT state is INITIALISING, expected OPERATIONAL"):
        monitor.raise_if_unwell(0)


def test_node_that_took_its_emergency_back_is_named_with_it() -> None:
    monitor = node_monitor()
    monitor.expect(NmtState.OPERATIONAL)
    monitor.on_emergency(bytes.fromhex("30 81 11 00 00 00 00 00"), 0)
    monitor.on_emergency(bytes(8), 0)
    monitor.on_heartbeat(b"\x7f", 0)
    with pytest.raises(DeviceFault, match=r"EMCY 0x8130 .* and its end, expected none\. It went away by itself"):
        monitor.raise_if_unwell(0)


def test_toggle_bit_of_node_guarding_is_no_state() -> None:
    monitor = node_monitor()
    monitor.expect(NmtState.OPERATIONAL)
    monitor.on_heartbeat(b"\x85", 0)
    monitor.raise_if_unwell(0)


def test_awaited_state_that_does_not_come_names_the_one_seen() -> None:
    monitor = node_monitor()
    with pytest.raises(DeviceTimeout, match="reports nothing so far after 0 s, expected OPERATIONAL"):
        monitor.await_state(NmtState.OPERATIONAL, 0.0, ask=lambda: None)
    monitor.on_heartbeat(b"\x7f", 0)
    with pytest.raises(DeviceTimeout, match="reports PRE-OPERATIONAL after 0 s, expected OPERATIONAL"):
        monitor.await_state(NmtState.OPERATIONAL, 0.0, ask=lambda: None)


def test_state_is_asked_for_again_until_it_is_reported() -> None:
    """A heartbeat from before the first time of asking counts for nothing."""
    monitor = node_monitor()
    monitor.on_heartbeat(b"\x05", 0)
    asked = []

    def ask() -> None:
        asked.append(1)
        if len(asked) > 1:
            monitor.on_heartbeat(b"\x05" if len(asked) > 2 else b"\x7f", 0)

    monitor.await_state(NmtState.OPERATIONAL, 30.0, ask)
    assert len(asked) == 3


def test_the_first_emergency_stays_until_it_is_reset() -> None:
    monitor = node_monitor()
    monitor.on_emergency(bytes.fromhex("10 23 01 00 00 00 00 00"), 0)
    monitor.on_emergency(bytes.fromhex("20 32 01 00 00 00 00 00"), 0)
    with pytest.raises(DeviceFault, match="EMCY 0x2310 continuous over-current, motor side"):
        monitor.raise_if_unwell(0)
    monitor.on_emergency(bytes(8), 0)
    monitor.raise_if_unwell(0)


def test_identifiers_and_codes_are_those_of_cia_301() -> None:
    """Tables "NMT node control" and "heartbeat protocol"; the predefined connection set."""
    assert (NMT_COB_ID, HEARTBEAT_COB_ID, HOST_NODE_ID) == (0x000, 0x700, 127)
    assert {command.name: command.value for command in NmtCommand} == {
        "START": 1,
        "STOP": 2,
        "ENTER_PRE_OPERATIONAL": 128,
        "RESET_NODE": 129,
        "RESET_COMMUNICATION": 130,
    }
    assert {state.name: state.value for state in NmtState} == {
        "INITIALISING": 0,
        "STOPPED": 4,
        "OPERATIONAL": 5,
        "PRE_OPERATIONAL": 127,
    }


def test_a_heartbeat_may_be_sent_between_two() -> None:
    sent: list[tuple[int, bytes]] = []
    began = threading.Event()

    def send(cob_id: int, data: bytes) -> None:
        sent.append((cob_id, data))
        began.set()

    producer = HeartbeatProducer(send, 9, period_s=3600.0, state=lambda: NmtState.OPERATIONAL)
    assert began.wait(60.0)
    producer.beat()
    producer.stop()
    assert sent == [(0x709, b"\x05"), (0x709, b"\x05")]
