"""The bus: opened by URL or refused, stamped on arrival, and what happens when it goes away."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import can
import pytest

from drivers.canopen.can_link import BUS_OFF, CanLink
from drivers.canopen.heartbeat import HOST_NODE_ID
from drivers.canopen.remote_bus import BoundedRemoteBus
from drivers.errors import BusDown, ProtocolViolation
from hil.simulator.addresses import Address
from hil.simulator.can_bridge import CanBridge
from tests.drivers.can_bench import bench, frame, new_channel, virtual_bus


@pytest.fixture
def channel() -> str:
    return new_channel()


@pytest.fixture
def deaf_server() -> Iterator[str]:
    """A TCP server that accepts and never says a word, as any other service's port might."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"ws://127.0.0.1:{server.getsockname()[1]}/"


@contextmanager
def answering_server(answer: bytes) -> Iterator[str]:
    """Serve one connection with a fixed answer."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(answer)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        try:
            yield f"ws://127.0.0.1:{server.getsockname()[1]}/"
        finally:
            thread.join()


def test_frame_is_stamped_after_the_sync_that_caused_it(channel: str) -> None:
    arrived: list[tuple[bytes, int]] = []
    event = threading.Event()

    def take(data: bytes, t_ns: int) -> None:
        arrived.append((data, t_ns))
        event.set()

    with CanLink.open(f"virtual:{channel}") as link, virtual_bus(channel) as device:
        link.subscribe(0x185, take)
        t_ns = link.sync()
        sync = device.recv(5.0)
        assert sync is not None
        assert (sync.arbitration_id, bytes(sync.data)) == (0x080, b"")
        device.send(frame(0x185, b"\x01\x02"))
        assert event.wait(60.0)
    [(data, arrival_ns)] = arrived
    assert data == b"\x01\x02"
    assert arrival_ns > t_ns


def test_remote_and_error_frames_are_not_data(channel: str) -> None:
    arrived: list[bytes] = []
    event = threading.Event()
    with CanLink.open(f"virtual:{channel}") as link, virtual_bus(channel) as device:
        link.subscribe(0x185, lambda data, t_ns: arrived.append(data))
        link.subscribe(0x186, lambda data, t_ns: event.set())
        device.send(can.Message(arbitration_id=0x185, is_remote_frame=True, is_extended_id=False))
        device.send(can.Message(arbitration_id=0x185, is_error_frame=True, is_extended_id=False))
        device.send(frame(0x186, b""))
        assert event.wait(60.0)
    assert arrived == []


def test_host_heartbeat_goes_out_until_the_link_is_closed(channel: str) -> None:
    with virtual_bus(channel) as device:
        with CanLink.open(f"virtual:{channel}") as link:
            link.produce_heartbeat(0.001)
            link.produce_heartbeat(0.001)  # the second inverter asks for it too
            beats = [device.recv(5.0) for _ in range(3)]
        assert [(beat.arbitration_id, bytes(beat.data)) for beat in beats if beat] == [
            (0x700 + HOST_NODE_ID, b"\x05")
        ] * 3
        while device.recv(0.0):
            pass
        assert device.recv(0.02) is None


def test_numbers_in_the_url_reach_the_interface_as_numbers(channel: str) -> None:
    with CanLink.open(f"virtual:{channel}?rx_queue_size=1"), virtual_bus(channel) as device:
        device.send(frame(1, b""), timeout=5.0)


@pytest.mark.parametrize(
    "url",
    [
        "virtual",
        "virtual:",
        "",
        "nosuchinterface:can0",
        "socketcan:nosuchcan0?bitrate=500000",
        "ws://127.0.0.1:1/",  # nothing listens on port 1
        "ws://127.0.0.1:notaport/",
        "ws://[::1/",
    ],
)
def test_bus_that_is_not_there_is_refused_with_advice(url: str) -> None:
    with pytest.raises(BusDown, match=r"can't be opened: .+ Check the bus URL of the rig file") as refused:
        CanLink.open(url)
    assert repr(url) in str(refused.value)


def test_server_that_says_nothing_is_refused_in_time(deaf_server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.canopen.remote_bus._TIMEOUT_S", 0.05)
    with pytest.raises(BusDown, match="timed out"):
        CanLink.open(deaf_server)


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n", "HTTP status 200, not with a WebSocket"),
        (b"\x00\x01\x00\x00\x00\x03\x01\x83\x01", "can't be opened"),  # a Modbus server's complaint
        (b"", "can't be opened"),
    ],
)
def test_server_of_another_kind_is_refused(answer: bytes, reason: str) -> None:
    with answering_server(answer) as url, pytest.raises(BusDown, match=reason):
        CanLink.open(url)


def test_frames_travel_both_ways_through_a_server(channel: str) -> None:
    event = threading.Event()
    with (
        CanBridge(Address("127.0.0.1", 0), channel) as bridge,
        CanLink.open(bridge.url) as link,
        virtual_bus(channel) as device,
    ):
        link.subscribe(0x185, lambda data, t_ns: event.set())
        device.send(frame(0x185, b"\x01"))
        assert event.wait(60.0)
        link.send(0x205, b"\x02")
        message = device.recv(5.0)
        assert message is not None
        assert (message.arbitration_id, bytes(message.data)) == (0x205, b"\x02")


def test_server_that_goes_away_is_bus_down_at_the_next_call(channel: str) -> None:
    with CanBridge(Address("127.0.0.1", 0), channel) as bridge:
        link = CanLink.open(bridge.url)
    with link:
        link._thread.join(60.0)
        with pytest.raises(BusDown, match=r"receiving ended.*hil sim"):
            link.sync()


def test_server_that_hangs_does_not_hang_the_end(channel: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stopped server process keeps its connections open and answers nothing, goodbye included."""
    with CanBridge(Address("127.0.0.1", 0), channel) as bridge:
        bus = BoundedRemoteBus(bridge.url)
        monkeypatch.setattr("drivers.canopen.remote_bus._TIMEOUT_S", 0.05)
        monkeypatch.setattr(bus.remote_protocol, "close", lambda: None)  # the goodbye gets lost
        bus.shutdown()
        assert bus.socket.fileno() == -1
        bus.shutdown()


def test_bus_that_goes_away_is_bus_down_at_every_call(channel: str) -> None:
    bus = virtual_bus(channel)
    with CanLink(bus) as link:
        bus.shutdown()
        link._thread.join(60.0)
        for _ in range(2):
            with pytest.raises(BusDown, match=r"receiving ended .*closed bus"):
                link.sync()


def test_closed_link_is_bus_down(channel: str) -> None:
    with CanLink.open(f"virtual:{channel}") as link:
        pass
    link.close()
    with pytest.raises(BusDown, match="is closed"):
        link.send(0x205, b"")


@pytest.mark.parametrize("raised", [ProtocolViolation("frame of 3 bytes"), None])
def test_frame_that_can_not_be_read_is_raised_once_and_receiving_continues(
    channel: str, raised: ProtocolViolation | None
) -> None:
    """A subscriber's own complaint, and what canopen's decoder makes of an NMT frame without data."""

    def refuse(data: bytes, t_ns: int) -> None:
        if raised is not None:
            raise raised

    event = threading.Event()
    with CanLink.open(f"virtual:{channel}") as link, virtual_bus(channel) as device:
        link.network.add_node(5)
        link.subscribe(0x000, refuse)
        link.subscribe(0x186, lambda data, t_ns: event.set())
        device.send(frame(0x000, b""))
        device.send(frame(0x186, b""))
        assert event.wait(60.0)
        with pytest.raises(ProtocolViolation, match=r"frame of 3 bytes|frame 0x000 with data \[\]"):
            link.sync()
        link.sync()


@pytest.mark.parametrize("inline", [True, False], ids=["in the sender's thread", "in a thread of its own"])
def test_defect_of_a_subscriber_ends_receiving_and_is_raised_at_the_end(channel: str, inline: bool) -> None:
    def fail(data: bytes, t_ns: int) -> None:
        raise ZeroDivisionError("a defect")

    link = CanLink.open(f"virtual:{channel}") if inline else CanLink(virtual_bus(channel))
    with virtual_bus(channel) as device:
        link.subscribe(0x185, fail)
        device.send(frame(0x185, b""))
        if link._thread is not None:
            link._thread.join(60.0)
    with pytest.raises(BusDown, match=r"receiving ended .a defect."):
        link.sync()
    with pytest.raises(ZeroDivisionError):
        link.close()


def test_callback_that_can_not_answer_any_more_is_no_defect(channel: str) -> None:
    """A simulated node may be taking a request while its link is closed: then it can't send the answer."""

    def answer(data: bytes, t_ns: int) -> None:
        raise BusDown("CAN bus is closed")

    link = CanLink.open(f"virtual:{channel}")
    with virtual_bus(channel) as device:
        link.subscribe(0x605, answer)
        device.send(frame(0x605, b""))
    with pytest.raises(BusDown, match=r"receiving ended .CAN bus is closed"):
        link.sync()
    link.close()


def error_frame(error_class: int) -> can.Message:
    """As an adapter passes it on to its host alone."""
    return can.Message(arbitration_id=error_class, is_error_frame=True, data=bytes(8))


def test_bus_off_is_bus_down_at_every_call() -> None:
    with bench() as rig:
        rig.m1.configure()
        rig.link._take(error_frame(BUS_OFF))
        for step in (rig.link.sync, rig.m1.raise_if_faulted, rig.m1.check):
            with pytest.raises(BusDown, match="bus-off: the controller has left the bus"):
                step()


def test_controller_that_says_it_is_off_the_bus_is_bus_down() -> None:
    class OffBus(can.interfaces.virtual.VirtualBus):
        @property
        def state(self) -> can.BusState:
            return can.BusState.ERROR

    link = CanLink(OffBus(new_channel()))
    with link:
        assert link._thread is not None
        link._thread.join(60.0)
        with pytest.raises(BusDown, match="bus-off"):
            link.sync()
