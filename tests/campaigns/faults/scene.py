"""A host, ``hil run``, and a rig, ``hil sim``, as processes of their own, and what can be done to them."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from drivers.canopen.can_link import CanLink
from drivers.inverter.cia402 import TORQUE_STATES, PowerState, state_of
from tests.campaigns.faults.clock import Clock
from tests.campaigns.faults.disk import Disk
from tests.campaigns.faults.tcp_proxy import TcpProxy

PATIENCE_S = 30.0


class NotBegun(Exception):
    """A host that ended before its drives were in operation, as on a machine that is too busy for it."""


@dataclass
class Place:
    """Where a host records, and by which clock: its own disk or clock where a fault needs one."""

    folder: Path
    disk: Disk | None = None
    clock: Clock | None = None

    @property
    def out(self) -> Path:
        """The recording."""
        return (self.folder if self.disk is None else self.disk.root) / "run.csv"

    @property
    def environment(self) -> dict[str, str]:
        """Of both processes, which tell where they are if they are aborted."""
        return {**os.environ, "PYTHONFAULTHANDLER": "1", **({} if self.clock is None else self.clock.environment)}


@dataclass
class Scene:
    """A host that drives a rig."""

    rig: subprocess.Popen[str]
    host: subprocess.Popen[str]
    bus: TcpProxy
    plc: TcpProxy
    place: Place
    url: str


@dataclass
class States:
    """The power states of both drives, asked for by SDO."""

    link: CanLink
    answers: dict[int, PowerState] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for node_id in (1, 2):
            self.link.subscribe(0x580 + node_id, lambda data, t_ns, node=node_id: self._take(node, data))

    def _take(self, node_id: int, data: bytes) -> None:
        if data[1:4] == b"\x41\x60\x00":
            self.answers[node_id] = state_of(int.from_bytes(data[4:6], "little"))

    def await_no_torque(self, may_ask: Callable[[], bool]) -> float:
        """Wait until neither drive is in a state that may carry torque; give how long that took [s].

        Ask for the states, or, where that would disturb a host, listen to the answers that it gets when it disarms.
        """
        began_s = time.monotonic()
        while len(self.answers) < 2 or any(state in TORQUE_STATES for state in self.answers.values()):
            if time.monotonic() - began_s > PATIENCE_S:
                raise TimeoutError(f"after {PATIENCE_S} s the drives are in {self.answers}")
            for node_id in (1, 2) if may_ask() else ():
                self.link.send(0x600 + node_id, b"\x40\x41\x60\x00\x00\x00\x00\x00")
            time.sleep(0.003)
        return time.monotonic() - began_s


@contextmanager
def scene(rig_path: Path, place: Place, experiment: str, real_time: bool) -> Iterator[Scene]:
    """Start rig and host; yields them once the drives are in operation."""
    hil, free_bus, free_plc = [sys.executable, "-m", "hil"], "ws://127.0.0.1:0/", "127.0.0.1:0"
    serve = [*hil, "sim", str(rig_path), "--bus", free_bus, "--modbus", free_plc, *["--real-time"] * real_time]
    with ExitStack() as stack:
        rig = stack.enter_context(_process(serve, place.environment))
        assert rig.stdout is not None
        ready = re.match(r"ready bus=ws://127.0.0.1:(\d+)(\S*) modbus=127.0.0.1:(\d+)", rig.stdout.readline())
        assert ready is not None
        bus = stack.enter_context(TcpProxy(int(ready[1])))
        plc = stack.enter_context(TcpProxy(int(ready[3])))
        at = ["--bus", f"ws://127.0.0.1:{bus.port}{ready[2]}", "--modbus", f"127.0.0.1:{plc.port}"]
        drive = [*hil, "run", str(rig_path), experiment, "--out", str(place.out), "--no-estimate", *at]
        host = stack.enter_context(_process(drive, place.environment))
        url = f"ws://127.0.0.1:{ready[1]}{ready[2]}"
        _await_operation(url, host)
        yield Scene(rig, host, bus, plc, place, url)


@contextmanager
def _process(command: list[str], environment: Mapping[str, str]) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8"
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def _await_operation(url: str, host: subprocess.Popen[str]) -> None:
    """Listen to the TPDOs of both drives; the host's own SDO is left alone."""
    states: dict[int, PowerState] = {}
    with CanLink.open(url) as link:
        for node_id in (1, 2):
            link.subscribe(
                0x180 + node_id,
                lambda data, t_ns, node=node_id: states.update({node: state_of(int.from_bytes(data[:2], "little"))}),
            )
        while list(states.values()) != [PowerState.OPERATION_ENABLED] * 2:
            if host.poll() is not None:
                raise NotBegun(host.communicate()[1])
            time.sleep(0.01)
