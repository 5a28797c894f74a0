"""``python -m tests.campaigns.faults.processes [--runs N] [--seed N]``: faults of real processes, by the wall clock.

A host, ``hil run``, and a rig, ``hil sim``, are processes of their own, between them TCP connections that can be cut or
go silent. At a random moment with torque on, one of them, the disk or the clock meets a fault; a third program on the
bus takes the states of the drives until none can carry torque. Prints a table of the worst time to that for each fault.

A disk of its own has to be mounted, which takes root; a clock of its own a C compiler. Without them it says so.
"""

import contextlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivers.canopen.can_link import CanLink
from drivers.errors import BusDown
from hil.recording import read_table
from tests.campaigns.faults.clock import Clock, compiler
from tests.campaigns.faults.disk import can_mount, disk
from tests.campaigns.faults.one_run import Outcome
from tests.campaigns.faults.rig import campaign_rig
from tests.campaigns.faults.runs import asked_for, tried
from tests.campaigns.faults.scene import PATIENCE_S, NotBegun, Place, Scene, States, scene

LIMIT_S = 0.25
"""Within this a dead host has to mean zero torque, with the defaults of a rig file."""

SUSPENDED_S = 1.0
"""How much longer than the drives need a suspended host sleeps [s]."""

STALL_S = 2.0
"""How long the disk takes nothing [s]."""

LASTING_S = 3.0
"""How long a run is watched that no fault must end [s]."""

GAP_S = 0.5
"""Between two rows of such a run [s]: less than what the fault would delay, more than a busy machine does."""

STEP_S = 3600
"""By how much the clock is set forward, or back [s]."""

TRIES = 5

BUSY = "busy machine|This machine was too busy|RPDO timeout"
"""What a host says that this machine, and not the fault, has ended: it only has to have left the drives disarmed."""

Meet = Callable[[Scene], None]


def kill_host(scene: Scene) -> None:
    """As the system does when memory is short."""
    scene.host.kill()


def suspend_host(scene: Scene) -> None:
    """As a debugger does; it continues later."""
    scene.host.send_signal(signal.SIGSTOP)


def stop_host(scene: Scene) -> None:
    """As Ctrl-C does."""
    scene.host.send_signal(signal.SIGINT)


def hang_up(scene: Scene) -> None:
    """As the end of an SSH connection does."""
    scene.host.send_signal(signal.SIGHUP)


def kill_rig(scene: Scene) -> None:
    """As when the bus's supply fails."""
    scene.rig.kill()


def fill_disk(scene: Scene) -> None:
    """As another program does that writes to it."""
    assert scene.place.disk is not None
    scene.place.disk.fill()


def stall_disk(scene: Scene) -> None:
    """As one that is slow to wake up, or a network drive."""
    assert scene.place.disk is not None
    scene.place.disk.stall(STALL_S)


def step_clock(seconds: int) -> Meet:
    """As the first answer of a time server does, for host and rig."""

    def meet(scene: Scene) -> None:
        assert scene.place.clock is not None
        scene.place.clock.step(seconds)

    return meet


@dataclass(frozen=True)
class Kind:
    """What is met, what the host has to say, and whether the drives have to stop by themselves.

    A host that continues must not be disturbed: who asks its drives for anything is a foreign controller.
    """

    meet: Meet
    cause: str = ""
    by_themselves: bool = False
    ends_it: bool = True
    needs: str = ""


KINDS: dict[str, Kind] = {
    "host killed (SIGKILL)": Kind(kill_host, by_themselves=True),
    "host suspended (SIGSTOP), and on": Kind(suspend_host, BUSY, by_themselves=True),
    "host interrupted (SIGINT)": Kind(stop_host, ""),
    "host's terminal gone (SIGHUP)": Kind(hang_up, ""),
    "bus connection cut": Kind(lambda scene: scene.bus.cut(), "CAN bus", by_themselves=True),
    "bus connection silent": Kind(lambda scene: scene.bus.swallow(), "no TPDO|CAN bus|heartbeat", by_themselves=True),
    "PLC connection cut": Kind(lambda scene: scene.plc.cut(), "PLC"),
    "PLC connection silent": Kind(lambda scene: scene.plc.swallow(), "PLC"),
    "rig killed (SIGKILL)": Kind(kill_rig, "CAN bus|no TPDO|PLC"),
    "disk full": Kind(fill_disk, "expected room for sample", needs="disk"),
    "disk stalled for 2 s": Kind(stall_disk, ends_it=False, needs="disk"),
    "clock set forward by an hour": Kind(step_clock(STEP_S), ends_it=False, needs="clock"),
    "clock set back by an hour": Kind(step_clock(-STEP_S), ends_it=False, needs="clock"),
}


def possible() -> dict[str, Kind]:
    """Return the kinds that this machine can have; say which it can't."""
    there = {"": True, "disk": can_mount(), "clock": compiler() is not None}
    for name, kind in KINDS.items():
        if not there[kind.needs]:
            print(f"not on this machine, which gives it no {kind.needs} of its own: {name}", file=sys.stderr)
    return {name: kind for name, kind in KINDS.items() if there[kind.needs]}


@contextmanager
def place_for(kind: Kind) -> Iterator[Place]:
    """Make a folder, with the disk or the clock that a fault needs."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        yield Place(
            folder,
            stack.enter_context(disk(folder)) if kind.needs == "disk" else None,
            Clock(folder) if kind.needs == "clock" else None,
        )


def run_one(kind: Kind, rig_path: Path, experiment: str, after_s: float, real_time: bool) -> Outcome:
    """Let one fault happen, and judge."""
    outcome = Outcome()
    with place_for(kind) as place, scene(rig_path, place, experiment, real_time) as at:
        time.sleep(after_s)
        with CanLink.open(at.url) as link, contextlib.suppress(BusDown):
            states = States(link)
            alive = at.host.poll() is None
            kind.meet(at)
            if not kind.ends_it:
                time.sleep(LASTING_S)
                stop_host(at)
            if kind.meet is not kill_rig:
                try:
                    outcome.zero_s = states.await_no_torque(lambda: kind.by_themselves or at.host.poll() is not None)
                except TimeoutError as error:
                    outcome.problems.append(str(error))
        if kind.by_themselves and outcome.zero_s > LIMIT_S:
            outcome.problems.append(f"torque was on for {outcome.zero_s:.3f} s")
        if kind.meet is suspend_host:
            time.sleep(SUSPENDED_S)
        at.host.send_signal(signal.SIGCONT)
        said = _last_words(at.host, outcome)
        if alive and not _was_busy(kind, said):
            outcome.said = (said or "ended") if kind.ends_it else ""
            _judge(kind, at, said, outcome)
    return outcome


def _was_busy(kind: Kind, said: str) -> bool:
    """Tell whether a host names this machine, and not the fault."""
    return re.search(BUSY, said) is not None and not (kind.cause and re.search(kind.cause, said))


def begun(run: Callable[[], Outcome]) -> Outcome:
    """Run, again if it did not come to begin: up to `TRIES` times."""
    for number in range(1, TRIES + 1):
        try:
            return run()
        except NotBegun as refused:
            said = str(refused)
            print(f"not begun, {number} of {TRIES} tries: {said.strip()}", file=sys.stderr, flush=True)
    return Outcome(problems=[f"not begun: {said}"])


def _last_words(host: subprocess.Popen[str], outcome: Outcome) -> str:
    """Return what a host says until it ends; of one that does not, where each of its threads is."""
    try:
        return host.communicate(timeout=PATIENCE_S)[1]
    except subprocess.TimeoutExpired:
        host.send_signal(signal.SIGABRT)
        said = host.communicate()[1]
        outcome.problems.append(f"the host did not end within {PATIENCE_S:g} s: {said}")
        return said


def _judge(kind: Kind, at: Scene, said: str, outcome: Outcome) -> None:
    if at.host.returncode == 0:
        outcome.problems.append("exit status 0")
    if kind.cause and not re.search(kind.cause, said):
        outcome.problems.append(f"said {said[-300:]!r}, expected {kind.cause!r}")
    if not kind.ends_it and "interrupted" not in said:
        outcome.problems.append(f"said {said[-300:]!r}, expected an interruption alone")
    for kept in (at.place.out, at.place.out.with_name("run.part.csv")):
        if kept.exists() and kept.read_text("utf-8").count("\n") > 1:
            time_s = read_table(kept).columns["time_s"]
            if not kind.ends_it and (gap_s := float(np.diff(time_s).max())) > GAP_S:
                outcome.problems.append(f"the recording has a gap of {gap_s:.2f} s")


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign."""
    asked = asked_for("tests.campaigns.faults.processes", 200, arguments)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup the hosts would outlive their terminals, too,
    signal.signal(signal.SIGINT, signal.default_int_handler)  # and in the background of a shell ignore Ctrl-C
    with tempfile.TemporaryDirectory() as name:
        rig, kinds = campaign_rig(Path(name), by_the_clock=True), possible()

        def one(number: int) -> tuple[str, str, Outcome]:
            drawn = random.Random(f"{asked.seed}:{number}")
            kind = list(kinds)[number % len(kinds)]
            experiment, real_time = drawn.choice(sorted(rig.experiments)), drawn.random() < 0.5
            after_s = drawn.uniform(0.0, 1.5)
            outcome = begun(lambda: run_one(kinds[kind], Path(name) / "rig.toml", experiment, after_s, real_time))
            return kind, f"after {after_s:.2f} s of {experiment}", outcome

        return tried(asked, one)


if __name__ == "__main__":
    sys.exit(main())
