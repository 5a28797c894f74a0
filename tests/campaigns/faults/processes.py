"""``python -m tests.campaigns.faults.processes [--runs N]``: faults of real processes, by the wall clock.

A host, ``hil run``, and a rig, ``hil sim``, are processes of their own, between them TCP connections that can be cut or
go silent. At a random moment with torque on, one of them meets a fault; a third program on the bus asks the drives for
their states until none can carry torque. Prints a table of the worst time to that for each fault.
"""

from __future__ import annotations

import argparse
import contextlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from drivers.canopen.can_link import CanLink
from drivers.errors import BusDown
from drivers.inverter.cia402 import TORQUE_STATES, PowerState, state_of
from hil.recording import read_table
from tests.campaigns.faults.__main__ import report
from tests.campaigns.faults.one_run import Outcome
from tests.campaigns.faults.rig import campaign_rig
from tests.campaigns.faults.tcp_proxy import TcpProxy

LIMIT_S = 0.25
"""Within this a dead host has to mean zero torque, with the defaults of a rig file."""

PATIENCE_S = 30.0

SUSPENDED_S = 1.0
"""How much longer than the drives need a suspended host sleeps [s]."""


@dataclass
class Scene:
    """A host that drives a rig."""

    rig: subprocess.Popen[str]
    host: subprocess.Popen[str]
    bus: TcpProxy
    plc: TcpProxy
    out: Path


Meet = Callable[[Scene], None]


def kill_host(scene: Scene) -> None:
    """As the system does when memory is short."""
    scene.host.kill()


def suspend_host(scene: Scene) -> None:
    """As a debugger does; it goes on later."""
    scene.host.send_signal(signal.SIGSTOP)


def stop_host(scene: Scene) -> None:
    """As Ctrl-C does."""
    scene.host.send_signal(signal.SIGINT)


def hang_up(scene: Scene) -> None:
    """As the end of an SSH connection does."""
    scene.host.send_signal(signal.SIGHUP)


@dataclass(frozen=True)
class Kind:
    """What is met, what the host has to say, and whether the drives have to stop by themselves.

    A host that goes on must not be disturbed: who asks its drives for anything is a foreign controller.
    """

    meet: Meet
    cause: str = ""
    by_themselves: bool = False
    options: tuple[str, ...] = ()


KINDS: dict[str, Kind] = {
    "host killed (SIGKILL)": Kind(kill_host, by_themselves=True),
    "host suspended (SIGSTOP), and on": Kind(suspend_host, "This machine was too busy", by_themselves=True),
    "host interrupted (SIGINT)": Kind(stop_host, ""),
    "host's terminal gone (SIGHUP)": Kind(hang_up, ""),
    "bus connection cut": Kind(lambda scene: scene.bus.cut(), "CAN bus", by_themselves=True),
    "bus connection silent": Kind(lambda scene: scene.bus.swallow(), "no TPDO|CAN bus|heartbeat", by_themselves=True),
    "PLC connection cut": Kind(lambda scene: scene.plc.cut(), "PLC"),
    "PLC connection silent": Kind(lambda scene: scene.plc.swallow(), "PLC"),
    "rig killed (SIGKILL)": Kind(lambda scene: scene.rig.kill(), "CAN bus|no TPDO|PLC"),
}


@dataclass
class _States:
    """The power states of both drives, asked for by SDO."""

    link: CanLink
    answers: dict[int, PowerState] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for node_id in (1, 2):
            self.link.subscribe(0x580 + node_id, lambda data, t_ns, node=node_id: self._take(node, data))

    def _take(self, node_id: int, data: bytes) -> None:
        if data[1:4] == b"\x41\x60\x00":
            self.answers[node_id] = state_of(int.from_bytes(data[4:6], "little"))

    def await_no_torque(self, ask: bool) -> float:
        """Wait until neither drive is in a state that may carry torque; give how long that took [s].

        Ask for the states, or listen to the answers the host gets when it disarms.
        """
        began_s = time.monotonic()
        self.answers.clear()
        while len(self.answers) < 2 or any(state in TORQUE_STATES for state in self.answers.values()):
            if time.monotonic() - began_s > PATIENCE_S:
                raise TimeoutError(f"after {PATIENCE_S} s the drives are in {self.answers}")
            for node_id in (1, 2) if ask else ():
                self.link.send(0x600 + node_id, b"\x40\x41\x60\x00\x00\x00\x00\x00")
            time.sleep(0.003)
        return time.monotonic() - began_s


@contextmanager
def scene(rig_path: Path, folder: Path, experiment: str, real_time: bool) -> Iterator[tuple[Scene, str]]:
    """Start rig and host; yields them once the drives are in operation, and where the bus is served."""
    hil = [sys.executable, "-m", "hil"]
    with ExitStack() as stack:
        rig = stack.enter_context(
            _process(
                [*hil, "sim", str(rig_path), "--bus", "ws://127.0.0.1:0/", "--modbus", "127.0.0.1:0"]
                + ["--real-time"] * real_time
            )
        )
        assert rig.stdout is not None
        ready = re.match(r"ready bus=ws://127.0.0.1:(\d+)(\S*) modbus=127.0.0.1:(\d+)", rig.stdout.readline())
        assert ready is not None
        bus = stack.enter_context(TcpProxy(int(ready[1])))
        plc = stack.enter_context(TcpProxy(int(ready[3])))
        out = folder / "run.csv"
        host = stack.enter_context(
            _process(
                [
                    *hil,
                    "run",
                    str(rig_path),
                    experiment,
                    "--out",
                    str(out),
                    "--no-estimate",
                    "--bus",
                    f"ws://127.0.0.1:{bus.port}{ready[2]}",
                    "--modbus",
                    f"127.0.0.1:{plc.port}",
                ]
            )
        )
        url = f"ws://127.0.0.1:{ready[1]}{ready[2]}"
        _await_operation(url, host)
        yield Scene(rig, host, bus, plc, out), url


@contextmanager
def _process(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
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
                raise AssertionError(host.communicate())
            time.sleep(0.01)


def run_one(kind: Kind, rig_path: Path, experiment: str, after_s: float, real_time: bool) -> Outcome:
    """Let one fault happen, and judge."""
    outcome = Outcome()
    with tempfile.TemporaryDirectory() as name, scene(rig_path, Path(name), experiment, real_time) as (at, url):
        time.sleep(after_s)
        alive = at.host.poll() is None
        with CanLink.open(url) as link, contextlib.suppress(BusDown):
            states = _States(link)
            kind.meet(at)
            if kind.meet is not KINDS["rig killed (SIGKILL)"].meet:
                outcome.zero_s = states.await_no_torque(kind.by_themselves)
        if kind.by_themselves and outcome.zero_s > LIMIT_S:
            outcome.problems.append(f"torque was on for {outcome.zero_s:.3f} s")
        if kind.meet is suspend_host:
            time.sleep(SUSPENDED_S)
        at.host.send_signal(signal.SIGCONT)
        _, said = at.host.communicate(timeout=PATIENCE_S)
        outcome.said = said or "ended"
        if alive:
            _judge(kind, at, said, outcome)
    return outcome


def _judge(kind: Kind, at: Scene, said: str, outcome: Outcome) -> None:
    if at.host.returncode == 0:
        outcome.problems.append("exit status 0")
    if kind.cause and not re.search(kind.cause, said):
        outcome.problems.append(f"said {said[-300:]!r}, expected {kind.cause!r}")
    for kept in (at.out, at.out.with_name("run.part.csv")):
        if kept.exists() and kept.read_text("utf-8").count("\n") > 1:
            read_table(kept)


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.faults.processes")
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    outcomes: dict[str, list[Outcome]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as name:
        rig = campaign_rig(Path(name), by_the_clock=True)
        for number in range(asked.runs):
            drawn = random.Random(f"{asked.seed}:{number}")
            kind = list(KINDS)[number % len(KINDS)]
            experiment, real_time = drawn.choice(sorted(rig.experiments)), drawn.random() < 0.5
            outcome = run_one(KINDS[kind], Path(name) / "rig.toml", experiment, drawn.uniform(0.0, 1.5), real_time)
            outcomes[kind].append(outcome)
            for problem in outcome.problems:
                print(f"run {number}: {kind} in {experiment}: {problem}", file=sys.stderr, flush=True)
    return report(outcomes)


if __name__ == "__main__":
    sys.exit(main())
