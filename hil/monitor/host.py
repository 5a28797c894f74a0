"""The rig's process: listens to the rig, runs experiments on request, ends at zero torque whatever happens.

::

    open the rig -> listen (SYNC, drives disarmed) -> order: start -> run_plan (arms, drives, disarms) -> listen ...

The end of the view (its connection closes), a stop signal and the order to quit are one and the same here: the
run under way ends at zero torque with the drives disarmed, then the process ends.
"""

from __future__ import annotations

import json
import queue
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from drivers.errors import DriverError
from hil.config.rig_file import Rig
from hil.errors import HilError
from hil.monitor.health import HealthWatch, plc_health
from hil.monitor.messages import Ended, Kind, Lost, Mark, Notice, Order, Quit, Ready, Reset, Start, Stop
from hil.monitor.outbox import Outbox
from hil.monitor.recorded_run import RecordedRun
from hil.monitor.warm_up import run_once
from hil.rig.addresses import with_addresses
from hil.rig.build import Devices, open_devices
from hil.rig.idle import Listening
from hil.rig.live import USUAL, OnlineSetup
from hil.rig.pacing import RealTimePacer, period_ns
from hil.rig.realtime import real_time
from hil.rig.stop import StopRequest, stop_on_signals
from hil.rig.timing import RunTiming

HEALTH_EVERY_NS = 200_000_000
"""How often the view is informed of the bus's health [ns]."""

TRY_AGAIN_S = 1.0
"""Pause before a bus that was lost is opened again [s]."""


@dataclass(frozen=True, slots=True)
class Job:
    """What the rig's process is for.

    Attributes
    ----------
    rig_path, rig
        The rig file, and what it says with the addresses of the command line.
    out
        Folder of the recordings.
    simulate
        Whether the rig is simulated, in this very process.
    trust_laws
        Whether the code of its model's own laws may run.
    setup
        What estimates the runs.
    """

    rig_path: Path
    rig: Rig
    out: Path
    simulate: bool = False
    trust_laws: bool = False
    setup: OnlineSetup = USUAL


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


def serve(job: Job, connection: Connection) -> None:
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
    def __init__(self, job: Job, connection: Connection, outbox: Outbox, stop: SessionStop) -> None:
        self._job = job
        self._connection = connection
        self._outbox = outbox
        self._stop = stop
        self._orders: queue.SimpleQueue[Start | Reset] = queue.SimpleQueue()
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
                case Start() | Reset():
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
            if isinstance(order, Start):
                self._run_experiment(rig, devices, health, order.experiment)
            elif isinstance(order, Reset):
                for failure in listening.reset_faults():
                    self._outbox.tell(Notice(time.monotonic_ns(), Kind.FAULT, failure))

    def _listen(self, devices: Devices, listening: Listening, health: HealthWatch) -> Start | Reset | None:
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
def _rig(job: Job) -> Iterator[Rig]:
    """Give the rig to open; simulated, it is served for the time of the block."""
    if not job.simulate:
        yield job.rig
        return
    from hil.simulator.loopback import IN_PROCESS, Address
    from hil.simulator.plant_factory import plant_for
    from hil.simulator.rig_server import RigServer

    plant = plant_for(job.rig, [], job.trust_laws)
    server = RigServer(plant, job.rig, f"{IN_PROCESS}monitor", Address("127.0.0.1", 0), real_time=True)
    with server:
        yield with_addresses(job.rig, server.bus_url, str(server.modbus))
