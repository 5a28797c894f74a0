"""The CAN bridge: frames both ways, and the addresses it may be served at."""

import socket
import struct
import threading
import uuid

import can
import pytest

from hil.errors import UsageError
from hil.simulator.addresses import Address, bus_address, host_port, modbus_address
from hil.simulator.can_bridge import CanBridge

ANY_PORT = Address("127.0.0.1", 0)


def remote(url: str) -> can.BusABC:
    return can.Bus(interface="remote", channel=url)


def test_carries_frames_both_ways_and_ends_every_thread() -> None:
    channel = str(uuid.uuid4())
    threads = threading.active_count()
    with CanBridge(ANY_PORT, channel) as bridge, can.Bus(interface="virtual", channel=channel) as slave:
        with remote(bridge.url) as host:
            slave.send(can.Message(arbitration_id=0x181, data=[1, 2, 3], is_extended_id=False))
            down = host.recv(5.0)
            host.send(can.Message(arbitration_id=0x80, is_extended_id=False))
            up = slave.recv(5.0)
    assert down is not None
    assert (down.arbitration_id, bytes(down.data)) == (0x181, b"\x01\x02\x03")
    assert up is not None
    assert up.arbitration_id == 0x80
    assert threading.active_count() == threads


def test_host_that_dies_in_the_middle_of_frames_is_no_defect() -> None:
    """Its connection is reset while frames are under way; a traceback of the library's thread fails the test."""
    channel = str(uuid.uuid4())
    threads = threading.active_count()
    frame = can.Message(arbitration_id=0x181, data=bytes(8), is_extended_id=False)
    with CanBridge(ANY_PORT, channel) as bridge, can.Bus(interface="virtual", channel=channel) as slave:
        host = remote(bridge.url)
        host.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # close() then resets
        host.socket.close()
        host._is_shutdown = True  # it died: it says no goodbye
        while threading.active_count() > threads + 1:  # the thread that accepts stays
            slave.send(frame)
    assert threading.active_count() == threads


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("127.0.0.1:5020", Address("127.0.0.1", 5020)),
        ("localhost:0", Address("127.0.0.1", 0)),
        ("[::1]:502", Address("::1", 502)),
    ],
)
def test_reads_loopback_addresses(text: str, address: Address) -> None:
    assert modbus_address(text) == address
    assert bus_address(f"ws://{text}/") == address


def test_reads_addresses_of_other_machines_to_connect_to() -> None:
    assert host_port("plc.example:502") == Address("plc.example", 502)


@pytest.mark.parametrize("text", ["0.0.0.0:502", "192.168.0.7:502", "example.org:502", "[::]:0"])
def test_refuses_what_others_could_reach(text: str) -> None:
    with pytest.raises(UsageError, match="this machine only"):
        modbus_address(text)
    with pytest.raises(UsageError, match="this machine only"):
        bus_address(f"ws://{text}/")


@pytest.mark.parametrize("url", ["socketcan:can0", "wss://127.0.0.1:1/", "127.0.0.1:0"])
def test_refuses_a_bus_url_of_another_kind(url: str) -> None:
    with pytest.raises(UsageError, match="expected ws://"):
        bus_address(url)
