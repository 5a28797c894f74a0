"""The rig's process: listens to the rig, runs experiments on request, ends at zero torque whatever happens.

::

    open the rig -> listen (SYNC, drives disarmed) -> order: start -> run_plan (arms, drives, disarms) -> listen ...

The end of the view (its connection closes), a stop signal and the order to quit are one and the same here: the
run under way ends at zero torque with the drives disarmed, then the process ends.
"""

from __future__ import annotations

import json
import math
import queue
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from drivers.canopen import emcy
from drivers.canopen.can_link import CanLink
from drivers.canopen.emcy import EMCY_COB_ID, RPDO_TIMEOUT
from drivers.canopen.heartbeat import HEARTBEAT_COB_ID, NmtState
from drivers.errors import DriverError
from drivers.inverter.inverter import Inverter
from drivers.plc.types import PlcStatus
from hil.config.rig_file import Rig
from hil.errors import HilError
from hil.monitor.live_estimation import run_once
from hil.monitor.messages import (
    Ended,
    Health,
    LogTopic,
    Lost,
    Mark,
    NodeHealth,
    Notice,
    Order,
    PlcHealth,
    Quit,
    Ready,
    Reset,
    StartExperiment,
    Stop,
    TimingHealth,
)
from hil.monitor.outbox import Outbox
from hil.monitor.recorded_run import RecordedRun
from hil.rig.build import Devices, open_devices
from hil.rig.idle import Listening
from hil.rig.live import USUAL, OnlineSetup
from hil.rig.pacing import NS_PER_S, RealTimePacer, period_ns
from hil.rig.realtime import real_time
from hil.rig.stop import StopRequest, stop_on_signals
from hil.rig.timing import Histogram, RunTiming
from hil.simulator.addresses import IN_PROCESS, Address, with_addresses

_NMT_TITLES = {state.value: state.title for state in NmtState}

Tell = Callable[[Notice], None]

HEALTH_EVERY_NS = 200_000_000
"""How often the view is informed of the bus's health [ns]."""

TRY_AGAIN_S = 1.0
"""Pause before a bus that was lost is opened again [s]."""


class NodeWatch:
    """Life signs of one node, taken where frames are received; what is wrong with a frame is the driver's to say."""

    def __init__(self, link: CanLink, inverter: Inverter, tell: Tell) -> None:
        self._inverter = inverter
        self._tell = tell
        self._name = inverter.settings.name
        self._beat: tuple[int, int] | None = None  # time [ns], NMT state
        self._emergency: emcy.Emergency | None = None
        self._n_emergencies = 0
        node_id = inverter.settings.node_id
        link.subscribe(HEARTBEAT_COB_ID + node_id, self._on_heartbeat)
        link.subscribe(EMCY_COB_ID + node_id, self._on_emergency)

    def look(self, now_ns: int, trouble: str | None) -> NodeHealth:
        """Tell its health at a moment of the monotonic clock [ns]."""
        settings, latest = self._inverter.settings, self._inverter.latest
        return NodeHealth(
            node_id=settings.node_id,
            power=None if latest is None else latest.state.value,
            nmt=None if self._beat is None else _NMT_TITLES.get(self._beat[1], f"0x{self._beat[1]:02X}"),
            heartbeat_age_s=None if self._beat is None else (now_ns - self._beat[0]) / NS_PER_S,
            heartbeat_limit_s=settings.heartbeat_timeout_ms / 1000.0,
            tpdo_age_s=None if latest is None else (now_ns - latest.t_ns) / NS_PER_S,
            emergency=None if self._emergency is None else str(self._emergency),
            n_emergencies=self._n_emergencies,
            trouble=trouble,
        )

    def _on_heartbeat(self, data: bytes, t_ns: int) -> None:
        if len(data) == 1:
            self._beat = (t_ns, data[0] & 0x7F)

    def _on_emergency(self, data: bytes, t_ns: int) -> None:
        emergency = emcy.decode(data)
        if emergency.code == RPDO_TIMEOUT and not self._inverter.is_armed:
            text = (
                f"{self._name}: has noticed that no command follows, as it is set up to (EMCY 0x{emergency.code:04X})"
            )
            self._tell(Notice(t_ns, LogTopic.INFO, text))
            return
        if emergency.is_reset:
            if self._emergency is None:
                return  # of what was none
            self._emergency = None
            self._tell(Notice(t_ns, LogTopic.EMCY, f"{self._name}: reset"))
            return
        self._emergency = emergency
        self._n_emergencies += 1
        self._tell(Notice(t_ns, LogTopic.EMCY, f"{self._name}: {emergency}"))


class HealthWatch:
    """Both nodes of an opened rig; see `NodeWatch`."""

    def __init__(self, devices: Devices, tell: Tell) -> None:
        self._m1 = NodeWatch(devices.link, devices.m1, tell)
        self._m2 = NodeWatch(devices.link, devices.m2, tell)

    def look(self, plc: PlcHealth, timing: RunTiming, troubles: tuple[str | None, str | None] = (None, None)) -> Health:
        """Tell the health of everything now."""
        now_ns = time.monotonic_ns()
        return Health(
            m1=self._m1.look(now_ns, troubles[0]),
            m2=self._m2.look(now_ns, troubles[1]),
            plc=plc,
            timing=timing_health(timing),
        )


def plc_health(status: PlcStatus | None, trouble: str | None) -> PlcHealth:
    """Tell the PLC's, from its last status; the age is by the host's monotonic clock."""
    age_s = None if status is None else status.age_ns(time.monotonic_ns()) / NS_PER_S
    return PlcHealth(status, age_s, trouble)


def timing_health(timing: RunTiming) -> TimingHealth:
    """Take the figures of a timing record that continues."""
    return TimingHealth(
        period_s=timing.period_ns / NS_PER_S,
        cycles=timing.cycles,
        missed=timing.missed,
        late=timing.late,
        unanswered=timing.unanswered,
        lateness_s=_spread_s(timing.lateness),
        reply_s=_spread_s(timing.reply_age),
    )


def _spread_s(histogram: Histogram) -> tuple[float, float, float]:
    """Return median, 99th percentile and largest value [s]; NaN while there is none."""
    if not histogram.total:
        return math.nan, math.nan, math.nan
    p50_ns, p99_ns = (histogram.quantile_ns(share) or 0 for share in (0.5, 0.99))
    return p50_ns / NS_PER_S, p99_ns / NS_PER_S, histogram.max_ns / NS_PER_S


@dataclass(frozen=True, slots=True)
class HostJob:
    """What the rig's process is for."""

    rig_path: Path  # the rig file, absolute
    rig: Rig  # what it says, at the addresses that count, for a host that is a monitor (`Rig.of_monitor`)
    out: Path  # folder of the recordings
    simulate: bool = False  # whether the rig is simulated, in this very process
    trust_laws: bool = False  # whether the code of its model's own laws may run
    setup: OnlineSetup = USUAL  # what estimates the runs


class SessionStop(StopRequest):
    """The end of the session; it ends the run under way too."""

    __slots__ = ("_run",)

    def __init__(self) -> None:
        super().__init__()
        self._run: StopRequest | None = None

    def request(self) -> None:
        """Ask for the end of the session, and of the run."""
        super().request()
        self.stop_run()

    def stop_run(self) -> None:
        """Ask for the end of the run under way, if there is one."""
        if self._run is not None:
            self._run.request()

    @contextmanager
    def of_run(self) -> Iterator[StopRequest]:
        """Give the stop request of a run, for the time of the block."""
        self._run = StopRequest()
        if self.requested:
            self._run.request()
        try:
            yield self._run
        finally:
            self._run = None


def serve(job: HostJob, connection: Connection) -> None:
    """Serve one rig to one view, until that ends; the entry point of the rig's process."""
    stop = SessionStop()
    with stop_on_signals(stop), Outbox(connection) as outbox:
        try:
            _Host(job, connection, outbox, stop).serve()
        except (DriverError, HilError, OSError) as error:
            outbox.tell(Ended(str(error)))
        except Exception:  # noqa: BLE001 - a defect: the view is where someone can read it
            outbox.tell(Ended(f"a defect of this program ended the rig's process:\n{traceback.format_exc()}"))
        else:
            outbox.tell(Ended())


class _Host:
    def __init__(self, job: HostJob, connection: Connection, outbox: Outbox, stop: SessionStop) -> None:
        self._job = job
        self._connection = connection
        self._outbox = outbox
        self._stop = stop
        self._orders: queue.SimpleQueue[StartExperiment | Reset] = queue.SimpleQueue()
        self._run: RecordedRun | None = None
        self._was_there = False

    def serve(self) -> None:
        threading.Thread(target=self._take_orders, name="from the view", daemon=True).start()
        run_once(self._job.rig.period_s, self._job.setup)  # compiled before there is a cycle that it could keep waiting
        with real_time() as grants, _rig(self._job) as rig:
            self._grants = grants
            while not self._stop.requested:
                try:
                    with open_devices(rig) as devices:
                        self._attend(rig, devices)
                except DriverError as error:
                    if not self._was_there:
                        raise
                    self._outbox.tell(Lost(str(error)))
                    self._pause()

    def _pause(self) -> None:
        until = time.monotonic() + TRY_AGAIN_S
        while time.monotonic() < until and not self._stop.requested:
            time.sleep(0.05)

    def _take_orders(self) -> None:
        """Take the view's orders; the end of the view is an order to quit."""
        while not self._stop.requested:
            try:
                order: Order = self._connection.recv()
            except (EOFError, OSError):
                order = Quit()
            match order:
                case Quit():
                    self._stop.request()
                case Stop():
                    self._stop.stop_run()
                case Mark():
                    if self._run is not None:
                        self._run.mark(order)
                case StartExperiment() | Reset():
                    self._orders.put(order)

    def _attend(self, rig: Rig, devices: Devices) -> None:
        health = HealthWatch(devices, self._outbox.tell)
        while not self._stop.requested:
            period = period_ns(rig.period_s)
            listening = Listening(devices, RealTimePacer(period), RunTiming(period))
            listening.begin()
            self._outbox.tell(Ready())
            self._was_there = True
            order = self._listen(devices, listening, health)
            listening.plc.finish()
            if isinstance(order, StartExperiment):
                self._run_experiment(rig, devices, health, order.experiment)
            elif isinstance(order, Reset):
                for failure in listening.reset_faults():
                    self._outbox.tell(Notice(time.monotonic_ns(), LogTopic.FAULT, failure))

    def _listen(self, devices: Devices, listening: Listening, health: HealthWatch) -> StartExperiment | Reset | None:
        """Cycle with the drives disarmed until something is to be done; None at the end of the session."""
        sent_ns = 0
        while not self._stop.requested:
            sample = listening.step()
            self._outbox.sample(sample, None)
            if sample.t_ns - sent_ns >= HEALTH_EVERY_NS:
                sent_ns = sample.t_ns
                plc = plc_health(devices.plc.latest, listening.plc.trouble)
                self._outbox.health(health.look(plc, listening.timing, listening.troubles))
            try:
                return self._orders.get_nowait()
            except queue.Empty:
                continue
        return None

    def _run_experiment(self, rig: Rig, devices: Devices, health: HealthWatch, name: str) -> None:
        timing = RunTiming(period_ns(rig.period_s))
        sent_ns = 0

        def watch(t_ns: int) -> None:
            nonlocal sent_ns
            if t_ns - sent_ns >= HEALTH_EVERY_NS:
                sent_ns = t_ns
                self._outbox.health(health.look(plc_health(devices.plc.latest, None), timing))

        with self._stop.of_run() as stop:
            self._run = RecordedRun(self._job.rig_path, rig, self._job.out, name, self._outbox, self._job.setup)
            try:
                grants = json.dumps(self._grants.as_json())
                self._run.drive(devices, stop, timing, watch, {"pace": "real", "real_time": grants})
            finally:
                self._run = None


@contextmanager
def _rig(job: HostJob) -> Iterator[Rig]:
    """Give the rig to open; simulated, it is served for the time of the block."""
    if not job.simulate:
        yield job.rig
        return
    from hil.simulator.driveline import plant_for
    from hil.simulator.rig_server import RigServer

    plant = plant_for(job.rig, [], job.trust_laws)
    server = RigServer(plant, job.rig, f"{IN_PROCESS}monitor", Address("127.0.0.1", 0), real_time=True)
    with server:
        yield with_addresses(job.rig, server.bus_url, str(server.modbus))
