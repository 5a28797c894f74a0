"""The rig's process: what it sends, what it keeps, and what it does when the view is gone."""

import multiprocessing
import re
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.canopen.can_link import CanLink
from drivers.canopen.emcy import EMCY_COB_ID, RPDO_TIMEOUT, Emergency
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID
from hil.config.rig_file import read_rig
from hil.monitor.host import HostJob, NodeWatch, SessionStop
from hil.monitor.messages import (
    Ended,
    Health,
    LogTopic,
    Lost,
    Notice,
    Over,
    Ready,
    Report,
    Reset,
    Samples,
    StartExperiment,
)
from hil.monitor.opening import open_rig
from hil.monitor.outbox import Outbox
from hil.monitor.source import RigSource
from hil.rig.experiments.base import Phase
from hil.simulator.addresses import with_addresses
from tests.monitor.fake_source import sample
from tests.rig.serving import served

PATIENCE_S = 60.0

OPERATIONAL = b"\x05"
"""State in a heartbeat: CiA 301, NMT operational."""


@contextmanager
def hosted(rig_path: Path, out: Path) -> Iterator[tuple[RigSource, list[Report]]]:
    """Run the rig's process against a rig served here; reports gather in the list by `await_report`."""
    with served(read_rig(rig_path), bus_url="ws://127.0.0.1:0/") as (server, rig):
        job = HostJob(rig_path, with_addresses(rig, server.bus_url, str(server.modbus)), out)
        with RigSource(job) as source:
            yield source, []


def await_report(source: RigSource, seen: list[Report], kind: type[Report]) -> Report:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        seen += source.poll()
        found = [report for report in seen if isinstance(report, kind)]
        if found:
            return found[-1]
        time.sleep(0.02)
    raise AssertionError(f"no {kind} in {[type(report).__name__ for report in seen]}")


@pytest.mark.parametrize(("armed", "kinds"), [(True, [LogTopic.EMCY, LogTopic.EMCY]), (False, [LogTopic.INFO])])
def test_a_drive_that_notices_the_end_of_the_commands_is_no_emergency(armed: bool, kinds: list[LogTopic]) -> None:
    noticed: list[Notice] = []
    heard: dict[int, Any] = {}
    link: Any = SimpleNamespace(subscribe=heard.__setitem__)
    settings = SimpleNamespace(name="m1", node_id=1, heartbeat_timeout_ms=300)
    inverter: Any = SimpleNamespace(settings=settings, latest=None, is_armed=armed)
    watch = NodeWatch(link, inverter, noticed.append)
    heard[EMCY_COB_ID + 1](Emergency(RPDO_TIMEOUT, 0x10, bytes(5)).encode(), 0)
    assert watch.look(0, None).n_emergencies == armed
    assert (watch.look(0, None).emergency is not None) == armed
    heard[EMCY_COB_ID + 1](bytes(8), 1)
    assert [notice.kind for notice in noticed] == kinds


@pytest.mark.campaign
def test_its_heartbeat_has_a_node_id_of_its_own(rig_path: Path, tmp_path: Path) -> None:
    """As ``hil monitor`` opens a rig: drives and other hosts can tell its heartbeat from that of ``hil run``."""
    rig = read_rig(rig_path)
    heard: dict[int, list[bytes]] = {rig.monitor_node_id: [], rig.host_node_id: []}
    with served(rig, bus_url="ws://127.0.0.1:0/") as (server, at), CanLink.open(server.bus_url) as observer:
        for node_id, frames in heard.items():
            observer.subscribe(HEARTBEAT_COB_ID + node_id, lambda data, t_ns, to=frames: to.append(data))
        addressed = with_addresses(at, server.bus_url, str(server.modbus))
        opening = open_rig(rig_path, addressed, tmp_path, simulate=False, model=None)
        with opening.source as source:
            await_report(source, [], Health)
            until = time.monotonic() + PATIENCE_S
            while not heard[rig.monitor_node_id] and time.monotonic() < until:
                time.sleep(0.02)
    assert rig.monitor_node_id != rig.host_node_id
    assert heard[rig.monitor_node_id][0] == OPERATIONAL
    assert heard[rig.host_node_id] == []


@pytest.mark.campaign
def test_it_listens_tells_its_health_and_resets(rig_path: Path, tmp_path: Path) -> None:
    with hosted(rig_path, tmp_path) as (source, seen):
        health = await_report(source, seen, Health)
        assert isinstance(health, Health)
        assert health.m1.power == "switch on disabled"
        samples = await_report(source, seen, Samples)
        assert isinstance(samples, Samples)
        assert {phase for _, phase in samples.rows} == {None}
        seen.clear()
        source.send(Reset())
        assert await_report(source, seen, Ready) == Ready()
        source.send(StartExperiment("no such experiment"))
        over = await_report(source, seen, Over)
        assert isinstance(over, Over)
        assert "cruise, reversal, tip" in str(over.reason)
    assert list(source.poll())[-1] == Ended()


@pytest.mark.campaign
def test_a_store_that_can_not_be_used_costs_no_recording(rig_path: Path, tmp_path: Path) -> None:
    out = tmp_path / "runs"
    out.mkdir()
    (out / "hil_runs").write_bytes(b"no database" * 1000)
    with hosted(rig_path, out) as (source, seen):
        await_report(source, seen, Ready)
        source.send(StartExperiment("cruise"))
        until = time.monotonic() + PATIENCE_S
        while len(measured_samples(seen)) < 20:
            assert time.monotonic() < until
            seen += source.poll()
            time.sleep(0.02)
    seen += source.poll()
    over = next(report for report in seen if isinstance(report, Over))
    assert over.stopped
    assert over.recording is not None
    assert Path(over.recording).exists()
    assert over.run_id is None
    assert any(isinstance(report, Notice) and report.kind is LogTopic.FAULT for report in seen)


@pytest.mark.campaign
def test_a_bus_that_is_lost_is_named_as_a_person_knows_it(rig_path: Path, tmp_path: Path) -> None:
    seen: list[Report] = []
    with ExitStack() as stack:
        with served(read_rig(rig_path), bus_url="ws://127.0.0.1:0/") as (server, rig):
            job = HostJob(rig_path, with_addresses(rig, server.bus_url, str(server.modbus)), tmp_path)
            source = stack.enter_context(RigSource(job))
            await_report(source, seen, Samples)
        lost = await_report(source, seen, Lost)
    assert isinstance(lost, Lost)
    assert server.bus_url in lost.reason
    assert not re.search(r"[0-9a-f]{8}-[0-9a-f]{4}", lost.reason)  # the server's own name of it, another one each time


def measured_samples(seen: list[Report]) -> list[object]:
    rows = [row for report in seen if isinstance(report, Samples) for row in report.rows]
    return [row for row, phase in rows if phase is Phase.MEASURE]


def test_the_outbox_keeps_the_last_samples_and_says_how_many_are_lost() -> None:
    near, far = multiprocessing.Pipe()
    outbox = Outbox(far, kept_samples=10)
    for k in range(25):
        outbox.sample(sample(k), None)
    outbox.tell(Ready())
    with outbox:
        sent = near.recv()
        assert [row.cycle for row, _ in sent.rows] == list(range(15, 25))
        assert sent.lost == 15
        assert near.recv() == Ready()
        outbox.sample(sample(25), None)
        again = near.recv()
        assert (len(again.rows), again.lost) == (1, 0)


def test_a_view_that_takes_nothing_does_not_keep_the_cycle_waiting() -> None:
    near, far = multiprocessing.Pipe()
    with Outbox(far, kept_samples=100) as outbox:
        for _ in range(20):
            for k in range(2000):
                outbox.sample(sample(k), None)
            time.sleep(0.06)  # the sender sends, until the pipe is full
        drain(near)


def drain(near: Connection) -> None:
    """Take everything, so that the sender comes to its end."""

    def take() -> None:
        with suppress(EOFError, OSError):
            while near.poll(1.0):
                near.recv()

    threading.Thread(target=take, daemon=True).start()


def test_the_end_of_a_session_ends_its_run_and_those_that_would_begin() -> None:
    session = SessionStop()
    session.stop_run()  # nothing runs: nothing happens
    with session.of_run() as stop:
        assert not stop.requested
        session.stop_run()
        assert stop.requested
    assert not session.requested
    with session.of_run() as stop:
        session.request()
        assert stop.requested
    with session.of_run() as stop:
        assert stop.requested
