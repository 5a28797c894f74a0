"""The served CAN bus takes its own host and no stranger: no browser's page, no path of the disk, no endless frame."""

import base64
import json
import os
import resource
import socket
import struct
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import can
import pytest

from drivers.canopen.can_link import open_bus
from drivers.canopen.remote_bus import token_file
from hil.simulator import can_bridge
from hil.simulator.addresses import Address
from hil.simulator.can_bridge import LONGEST_FRAME_BYTES, CanBridge


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture
def bridge() -> Iterator[CanBridge]:
    with CanBridge(Address("127.0.0.1", 0), str(uuid.uuid4())) as bridge:
        yield bridge


@pytest.fixture
def slave(bridge: CanBridge) -> Iterator[can.BusABC]:
    channel = bridge._server.config["channel"]
    with can.Bus(interface="virtual", channel=channel) as slave:
        yield slave


def ask(bridge: CanBridge, path: str, *headers: str, method: str = "GET") -> tuple[socket.socket, bytes]:
    """Send an HTTP request as written; return the connection and the beginning of the answer."""
    connection = socket.create_connection(("127.0.0.1", bridge.port), 5.0)
    lines = [f"{method} {path} HTTP/1.1", f"Host: 127.0.0.1:{bridge.port}", *headers]
    connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
    return connection, connection.recv(4096)


def upgrade(bridge: CanBridge, path: str | None = None, *more: str) -> tuple[socket.socket, bytes]:
    key = base64.b64encode(os.urandom(16)).decode()
    return ask(
        bridge,
        urlsplit(bridge.url).path if path is None else path,
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Protocol: can.json.v1",
        *more,
    )


def status_of(answer: bytes) -> int:
    return int(answer.split(b" ", 2)[1])


def frame(opcode: int, data: bytes, length: int | None = None) -> bytes:
    """A masked frame (mask 0); of a claimed length."""
    n = len(data) if length is None else length
    head = bytes([0x80 | opcode, 0x80 | (n if n < 126 else 126 if n < 1 << 16 else 127)])
    return head + (b"" if n < 126 else struct.pack(">H" if n < 1 << 16 else ">Q", n)) + bytes(4) + data


def request(kind: str, payload: object) -> bytes:
    return frame(1, json.dumps({"type": kind, "payload": payload}).encode())


@pytest.mark.parametrize(
    "path",
    ["/", "/wrong/", "/../../../../../../etc/passwd", "/index.html", "//etc/passwd", "/%2e%2e/x", "/" + "a" * 32 + "/"],
)
def test_without_its_token_nobody_is_served(bridge: CanBridge, path: str) -> None:
    for connection, answer in (ask(bridge, path), upgrade(bridge, path)):
        assert status_of(answer) == 403
        assert b"root:" not in answer
        connection.close()


@pytest.mark.parametrize("origin", ["http://127.0.0.1", "https://example.org", "null", ""])
def test_a_browser_is_not_served_even_with_the_token(bridge: CanBridge, origin: str) -> None:
    connection, answer = upgrade(bridge, None, f"Origin: {origin}")
    assert status_of(answer) == 403
    connection.close()


def test_nothing_but_a_websocket_is_served(bridge: CanBridge) -> None:
    path = urlsplit(bridge.url).path
    for asked, method in (
        (path, "GET"),
        (f"{path}../../../../../../../../etc/passwd", "GET"),
        (path, "HEAD"),
        (path, "POST"),
    ):
        connection, answer = ask(bridge, asked, method=method)
        assert status_of(answer) in (403, 426, 501)
        assert b"root:" not in answer
        connection.close()


def test_who_names_the_token_is_served(bridge: CanBridge, slave: can.BusABC) -> None:
    connection, answer = upgrade(bridge)
    assert status_of(answer) == 101
    connection.sendall(request("bus_request", {"config": {"interface": "serial", "channel": "/dev/null"}}))
    connection.sendall(request("message", {"arbitration_id": 0x80, "data": [], "is_extended_id": False}))
    got = slave.recv(5.0)
    assert got is not None
    assert got.arbitration_id == 0x80
    connection.close()


@pytest.mark.parametrize("length", [LONGEST_FRAME_BYTES + 1, 1 << 16, 1 << 33, 1 << 40, (1 << 63) - 1, (1 << 64) - 1])
def test_a_frame_that_claims_too_much_ends_its_connection_and_makes_no_room(
    bridge: CanBridge, slave: can.BusABC, length: int
) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    connection, _ = upgrade(bridge)
    connection.sendall(request("bus_request", {"config": {}}) + frame(2, b"", length))
    while connection.recv(4096):
        pass
    connection.close()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB
    with open_bus(bridge.url) as host:  # the next one is served
        host.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        assert slave.recv(5.0) is not None


ODD = [
    b"[" * 3000,
    b"{}",
    b"[]",
    b"\xff",
    json.dumps({"type": "message", "payload": {"arbitration_id": "x"}}).encode(),
    json.dumps({"type": "message", "payload": {"arbitration_id": 1 << 40, "data": []}}).encode(),
    json.dumps({"type": "message", "payload": {"arbitration_id": 1, "data": [0] * 64, "is_fd": True}}).encode(),
    json.dumps(
        {"type": "message", "payload": {"arbitration_id": 1, "data": [0] * 40, "is_extended_id": False}}
    ).encode(),
    json.dumps({"type": "periodic_start", "payload": {"msg": {"arbitration_id": 1, "data": []}, "period": 0}}).encode(),
    json.dumps({"type": "periodic_start", "payload": {}}).encode(),
    json.dumps({"type": "periodic_stop", "payload": 5}).encode(),
]


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("first", [True, False])
def test_what_is_no_frame_of_a_bus_reaches_no_device(
    bridge: CanBridge, slave: can.BusABC, odd: bytes, first: bool, capfd: pytest.CaptureFixture[str]
) -> None:
    connection, _ = upgrade(bridge)
    connection.sendall((b"" if first else request("bus_request", {"config": {}})) + frame(1, odd) + frame(8, b""))
    connection.settimeout(5.0)
    while connection.recv(4096):
        pass
    connection.close()
    assert slave.recv(0.0) is None
    assert capfd.readouterr().out == ""  # the line of hil sim is for scripts


def drip(connections: list[socket.socket], texts: list[bytes], over: threading.Event) -> None:
    """Send each its text, one byte every 0.1 s: a socket's own time-out never comes."""
    for number in range(max(map(len, texts))):
        for connection, text in zip(connections, texts, strict=True):
            with suppress(OSError):
                connection.send(text[number : number + 1])
        if over.wait(0.1):
            return


def slow(bridge: CanBridge, named: bool) -> tuple[socket.socket, bytes]:
    """Connect and, with the token, upgrade; what is left to be sent, slowly."""
    if named:
        return upgrade(bridge)[0], frame(1, bytes(1000), 1000)
    return socket.create_connection(("127.0.0.1", bridge.port), 5.0), b"GET / HTTP/1.1\r\nX: " + bytes(1000)


@pytest.mark.parametrize("named", [False, True])
def test_a_handshake_has_one_deadline_however_slowly_it_is_sent(
    bridge: CanBridge, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(can_bridge, "HANDSHAKE_S", 0.5)
    connection, text = slow(bridge, named)
    over, begun = threading.Event(), time.monotonic()
    thread = threading.Thread(target=drip, args=([connection], [text], over))
    thread.start()
    connection.settimeout(10.0)
    with suppress(ConnectionError):
        while connection.recv(4096):
            pass
    took_s = time.monotonic() - begun
    over.set()
    thread.join()
    connection.close()
    assert took_s < 5.0


def test_a_host_of_the_same_user_finds_the_token_of_the_port(bridge: CanBridge, slave: can.BusABC) -> None:
    """A rig file names the port alone."""
    assert token_file(bridge.port).stat().st_mode & 0o077 == 0
    with open_bus(f"ws://127.0.0.1:{bridge.port}/") as host:
        host.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        assert slave.recv(5.0) is not None
