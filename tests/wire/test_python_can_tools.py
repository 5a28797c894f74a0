"""python-can's own programs on this bus: logger, player and viewer as processes, over the loopback server.

The bus URL of a SocketCAN interface goes to the same library; where the kernel has none, opening it is as far as a
test gets.
"""

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
import uuid
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import can
import pytest

from drivers.canopen.can_link import CanLink
from drivers.errors import BusDown
from hil.config.rig_file import read_rig
from hil.errors import UsageError
from hil.rig.build import open_devices
from hil.rig.check import DeviceVerdict, check_rig
from hil.rig.trace import BusTrace
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.can_bridge import CanBridge
from hil.simulator.driveline import plant_for
from hil.simulator.faults import BusFaults, RigFaults
from hil.simulator.rig_server import RigServer
from tests.drivers.can_bench import virtual_bus
from tests.rig.serving import EXAMPLE, Samples, run, served
from tests.wire.traced import traced_run

ANY_PORT = Address("127.0.0.1", 0)
PATIENCE_S = 60.0
INTERFACE = "vcan0"
"""A SocketCAN interface a test machine may have: ``ip link add dev vcan0 type vcan``."""

Frames = Counter[tuple[int, bytes]]


def frames_of(path: Path) -> Frames:
    with can.LogReader(path) as reader:
        return Counter((message.arbitration_id, bytes(message.data)) for message in reader)


@contextmanager
def program(module: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run one of python-can's programs; it is ended with the block."""
    command = [sys.executable, "-u", "-m", module, *arguments]
    ignored = signal.signal(signal.SIGINT, signal.default_int_handler)  # what ignores Ctrl-C hands that down, as nohup
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    signal.signal(signal.SIGINT, ignored)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def interrupt(process: subprocess.Popen[str]) -> None:
    """Press Ctrl-C until the program ends: one may fall where the program, or its closing of a socket, swallows it."""
    deadline = time.monotonic() + PATIENCE_S
    while process.poll() is None:
        assert time.monotonic() < deadline, f"{process.args} continues after every Ctrl-C"
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(5.0)


def await_line(process: subprocess.Popen[str], word: str) -> None:
    assert process.stdout is not None
    for line in process.stdout:
        if word in line:
            return
    raise AssertionError(f"{process.args} ended without saying {word!r}")


@pytest.mark.campaign
def test_logger_logs_every_frame_of_a_run(tmp_path: Path) -> None:
    logged, traced = tmp_path / "logged.log", tmp_path / "traced.log"
    with served(bus_url="ws://127.0.0.1:0/") as (server, rig):
        # With a limit of its size the log's own size is asked after each frame, and that writes the frame out.
        target = ("-f", str(logged), "-s", str(10**9))
        with program("can.logger", "-i", "remote", "-c", server.bus_url, *target) as logger:
            await_line(logger, "Can Logger")
            with open_devices(rig) as devices, BusTrace(traced) as trace:
                devices.link.trace_by(trace.take)
                run(rig, devices, Samples(), experiment="reversal")
                devices.link.trace_by(None)
            await_frames(logged, sum(frames_of(traced).values()))
            interrupt(logger)
    missing = frames_of(traced) - frames_of(logged)
    assert not missing, f"frames the logger did not see: {missing}"


def await_frames(path: Path, count: int) -> None:
    """Wait until a text log has so many lines: the logger is another process, behind another socket."""
    deadline = time.monotonic() + PATIENCE_S
    while not path.exists() or path.read_bytes().count(b"\n") < count:
        assert time.monotonic() < deadline, f"{path} did not come to {count} frames"
        time.sleep(0.05)


def test_player_plays_a_trace_onto_the_bus(tmp_path: Path) -> None:
    trace = tmp_path / "run.blf"
    traced_run(trace)
    channel = str(uuid.uuid4())
    with CanBridge(ANY_PORT, channel) as bridge, virtual_bus(channel) as listener:
        arguments = ("-i", "remote", "-c", bridge.url, "--ignore-timestamps", "-g", "0", str(trace))
        with program("can.player", *arguments) as player:
            played, heard = frames_of(trace), Frames()
            while heard.total() < played.total():
                message = listener.recv(PATIENCE_S)
                assert message is not None, f"the player stopped after {heard.total()} frames"
                heard[message.arbitration_id, bytes(message.data)] += 1
            player.wait(PATIENCE_S)
    assert heard == played


@pytest.mark.campaign
def test_viewer_shows_both_drives(tmp_path: Path) -> None:
    """It needs a terminal: a pseudo-terminal wide enough for its table."""
    with served(bus_url="ws://127.0.0.1:0/") as (server, rig):
        command = [sys.executable, "-m", "can.viewer", "-i", "remote", "-c", server.bus_url]
        terminal, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 160, 0, 0))
        environment = {**os.environ, "TERM": "xterm"}
        viewer = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, close_fds=True)
        os.close(theirs)
        try:
            shown = await_screen(terminal, b"Count")
            with open_devices(rig) as devices:
                run(rig, devices, Samples(), experiment="reversal")
            shown += await_screen(terminal, b"0x182")
            os.write(terminal, b"q")
            shown += rest_of(terminal)
            assert viewer.wait(PATIENCE_S) == 0
        finally:
            if viewer.poll() is None:
                viewer.kill()
            viewer.wait()
            os.close(terminal)
    for cob_id in (b"0x080", b"0x181", b"0x182", b"0x201", b"0x202"):
        assert cob_id in shown


def await_screen(terminal: int, word: bytes) -> bytes:
    """Read what is drawn until a word is."""
    drawn, deadline = b"", time.monotonic() + PATIENCE_S
    while word not in drawn:
        ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))
        assert ready, f"{word!r} was not drawn, but {drawn[-400:]!r}"
        drawn += os.read(terminal, 4096)
    return drawn


def rest_of(terminal: int) -> bytes:
    """Read what is drawn until the program is gone."""
    drawn = b""
    while True:
        try:
            piece = os.read(terminal, 4096)
        except OSError:  # how Linux says that nobody holds the other end
            return drawn
        if not piece:
            return drawn
        drawn += piece


def test_socketcan_that_is_not_there_is_refused_by_name() -> None:
    """The URL reaches python-can's SocketCAN back end, whose complaint is reported."""
    with pytest.raises(BusDown, match=r"'socketcan:nosuchcan0\?.*can't be opened"):
        CanLink.open("socketcan:nosuchcan0?bitrate=500000")


@pytest.mark.skipif(
    not Path(f"/sys/class/net/{INTERFACE}").exists(),
    reason=f"no SocketCAN interface {INTERFACE} here (modprobe vcan; ip link add dev {INTERFACE} type vcan)",
)
def test_frames_travel_over_socketcan() -> None:
    with CanLink.open(f"socketcan:{INTERFACE}") as link, can.Bus(interface="socketcan", channel=INTERFACE) as device:
        link.sync()
        message = device.recv(PATIENCE_S)
    assert message is not None
    assert (message.arbitration_id, bytes(message.data)) == (0x80, b"")


def test_a_simulated_rig_on_a_bus_of_the_kernel_says_when_there_is_none() -> None:
    server = rig_server("socketcan:vcan93")
    with pytest.raises(BusDown, match="'socketcan:vcan93' can't be opened"), server:
        pass


@pytest.mark.parametrize(
    ("url", "faults", "wanted"),
    [
        ("socketcan:can0", RigFaults(), r"expected ws://HOST:PORT/"),  # real drives may be on it
        (f"socketcan:{INTERFACE}", RigFaults(bus=BusFaults(off_at_step=5)), "got faults of the bus"),
    ],
)
def test_a_simulated_rig_is_not_served_where_it_must_not_be(url: str, faults: RigFaults, wanted: str) -> None:
    with pytest.raises(UsageError, match=wanted):
        rig_server(url, faults)


@pytest.mark.skipif(
    not Path(f"/sys/class/net/{INTERFACE}").exists(),
    reason=f"no SocketCAN interface {INTERFACE} here (modprobe vcan; ip link add dev {INTERFACE} type vcan)",
)
def test_a_simulated_rig_is_driven_over_socketcan() -> None:
    with rig_server(f"socketcan:{INTERFACE}") as server:
        rig = with_addresses(read_rig(EXAMPLE), server.bus_url, str(server.modbus))
        findings = check_rig(rig)
    assert [finding.verdict for finding in findings] == [DeviceVerdict.AGREES] * 4


def rig_server(bus_url: str, faults: RigFaults | None = None) -> RigServer:
    rig = read_rig(EXAMPLE)
    return RigServer(plant_for(rig, []), rig, bus_url, ANY_PORT, faults)
