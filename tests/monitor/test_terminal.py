"""`hil monitor` in a real terminal of 80 by 24: keys in, screen text out, drives disarmed however it ends."""

import json
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from hil.config.rig_file import read_rig
from hil.recording.formats import read_table
from hil.simulator.rig_server import RigServer
from hil.store import RunStore
from tests.monitor.terminal import LEAVE_SCREEN, PATIENCE_S, Terminal
from tests.rig.observer import assert_disarmed
from tests.rig.serving import served

pytestmark = pytest.mark.timeout(300)  # two programs start up in each test, on a machine that may be busy


@contextmanager
def watched(rig_path: Path, out: Path) -> Iterator[tuple[Terminal, RigServer]]:
    """Serve the rig from this process, watch it from a terminal, and wait until it is listened to."""
    with served(read_rig(rig_path), bus_url="ws://127.0.0.1:0/") as (server, _):
        addresses = ("--bus", server.bus_url, "--modbus", str(server.modbus))
        with Terminal("monitor", str(rig_path), *addresses, "--out", str(out)) as terminal:
            terminal.await_text("LISTENING", "switch on disabled", "series clutch open permits")
            yield terminal, server


def start(terminal: Terminal) -> None:
    """Start the first experiment of the list, the cruise."""
    terminal.press("e")
    terminal.await_text("Start an experiment", "> cruise", "Base torque at most ±500 Nm, PRBS ±120 Nm")
    terminal.press("\r")
    terminal.await_text("Press y")
    terminal.press("y")
    terminal.await_text("RUNNING cruise measure", "operation enabled")


def assert_restored(terminal: Terminal) -> None:
    """Line mode and echo are as before, and the terminal's own screen is back."""
    assert terminal.settings == terminal.settings_before
    assert LEAVE_SCREEN in terminal.output


@pytest.mark.campaign
def test_a_day_at_the_rig(rig_path: Path, tmp_path: Path) -> None:
    out = tmp_path / "runs"
    with watched(rig_path, out) as (terminal, server):
        start(terminal)
        terminal.press("m")
        terminal.await_text("What happened?")
        terminal.press("bump x 1\r")
        terminal.await_text("bump x 1 (at")
        for page, shown in (
            ("2", "z plane"),
            ("3", "damping ratio"),
            ("4", "HEARTBEAT".lower()),
            ("5", "latest first"),
            ("\t", "torque [Nm]"),
        ):
            terminal.press(page)
            terminal.await_text(shown)
        terminal.resize(60, 20)
        terminal.await_text("The terminal has 60 x 20", "80 x 24")
        terminal.resize(160, 50)
        terminal.await_text("z plane", "PRBS [Nm]", "permits")
        terminal.resize(80, 24)
        terminal.await_text("torque [Nm]")
        terminal.press(" ")
        terminal.await_text("LISTENING")  # on a loaded machine what the bus lacks comes before how the run ended
        assert server.torque_nm == (0.0, 0.0)
        terminal.press("q")
        assert terminal.await_end() == 0
        assert_restored(terminal)
        assert_disarmed(server.bus_url, 1, 2)
        assert "cruise stopped by the operator:" in terminal.text, terminal.text[-900:]
    (recording,) = out.glob("cruise-*.parquet")
    metadata = read_table(recording).metadata
    (event,) = json.loads(metadata["events"])
    assert event["text"] == "bump x 1"
    assert 0.0 < event["time_s"] < read_table(recording).columns["time_s"][-1]
    with RunStore(out) as store:
        (run,) = store.find()
        assert run.entry.outcome == "stopped by the operator"


LONGER = pytest.mark.campaign
"""Each of these starts two programs: one way out is tried at every change, the others by ``make campaign``."""


@pytest.mark.parametrize("how", ["\x03", *(pytest.param(how, marks=LONGER) for how in ("q", "SIGTERM", "SIGHUP"))])
def test_every_way_out_disarms(rig_path: Path, tmp_path: Path, how: str) -> None:
    with watched(rig_path, tmp_path / "runs") as (terminal, server):
        start(terminal)
        if how.startswith("SIG"):
            terminal.signal(signal.Signals[how])
        else:
            terminal.press(how)
        assert terminal.await_end() == (0 if how == "q" else 130)
        assert_restored(terminal)
        assert_disarmed(server.bus_url, 1, 2)
        assert server.torque_nm == (0.0, 0.0)
    assert len(list((tmp_path / "runs").glob("cruise-*.parquet"))) == 1


@LONGER
def test_a_killed_view_leaves_nothing_armed(rig_path: Path, tmp_path: Path) -> None:
    with watched(rig_path, tmp_path / "runs") as (terminal, server):
        start(terminal)
        terminal.signal(signal.SIGKILL)
        until = time.monotonic() + PATIENCE_S
        while server.torque_nm != (0.0, 0.0) or not list((tmp_path / "runs").glob("cruise-*.parquet")):
            assert time.monotonic() < until
            time.sleep(0.05)
        assert_disarmed(server.bus_url, 1, 2)


@pytest.mark.campaign
def test_a_terminal_that_goes_away_leaves_nothing_armed(rig_path: Path, tmp_path: Path) -> None:
    with watched(rig_path, tmp_path / "runs") as (terminal, server):
        start(terminal)
        terminal.hang_up()
        assert terminal.await_end() == 130
        assert_disarmed(server.bus_url, 1, 2)
        assert server.torque_nm == (0.0, 0.0)
    assert len(list((tmp_path / "runs").glob("cruise-*.parquet"))) == 1


@LONGER
def test_a_killed_rig_process_is_reported(rig_path: Path, tmp_path: Path) -> None:
    with watched(rig_path, tmp_path / "runs") as (terminal, _):
        for child in children(terminal.pid):
            os.kill(child, signal.SIGKILL)
        assert terminal.await_end() == 3
        assert_restored(terminal)
        assert "without saying that the drives are" in terminal.text.replace("\n", " ")


@pytest.mark.campaign
def test_a_dead_drive_ends_the_run_and_shows(rig_path: Path, tmp_path: Path) -> None:
    with watched(rig_path, tmp_path / "runs") as (terminal, server):
        start(terminal)
        take_off_the_bus(server)
        terminal.await_text("cruise ENDED EARLY")
        terminal.press("4")
        terminal.await_text("TROUBLE", "STALE", "HEARTBEAT LOST", "inverter m2")
        terminal.press("q")
        assert terminal.await_end() == 0
        assert_disarmed(server.bus_url, 1)


def take_off_the_bus(server: RigServer) -> None:
    """Let m2's CAN controller leave the bus with the next SYNC but a few."""
    node = server._slaves._m2
    assert node is not None
    node._faults = replace(node._faults, bus_off_at_step=node._syncs + 10)


def children(pid: int) -> list[int]:
    """Processes a process has started (by its main thread), the one with the rig among them."""
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in path.read_text(encoding="ascii").split()]
