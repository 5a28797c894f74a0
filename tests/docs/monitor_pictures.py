"""The pictures of docs/monitor.md: a cruise of the example's rig in simulated time, drawn without a terminal.

Run it by ``python -m tests.docs.monitor_pictures``.
"""

import uuid
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from estimator.physics.joint import Shaft
from hil.config.rig_file import Rig, read_rig
from hil.monitor.app import MonitorApp
from hil.monitor.host import HealthWatch, plc_health
from hil.monitor.messages import Began, Ended, Health, Order, Ready, Report, Samples
from hil.monitor.state import LiveState
from hil.rig.build import open_devices
from hil.rig.experiments.base import Phase
from hil.rig.pacing import FreePacer, period_ns
from hil.rig.plan import plan_run
from hil.rig.realtime import real_time
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.rig.timing import RunTiming
from hil.sample import Sample
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.driveline import DEFAULT_BUS, plant_for
from hil.simulator.rig_server import RigServer
from tests.monitor.fake_source import FakeSource
from tests.rig.serving import Samples as Recorded

ROOT = Path(__file__).resolve().parents[2]
PICTURES = (
    ("overview", "overview", (80, 24)),
    ("model", "model", (80, 24)),
    ("bus", "bus", (80, 24)),
    ("large", "overview", (150, 46)),
)
SHOWN_S = 24.0
"""How far into the measured part the pictures are."""


class Played(FakeSource):
    """Says the bus's health again and again, as a rig does that continues; ends when it is ordered to."""

    _last: Sequence[Report] = ()

    def poll(self) -> Sequence[Report]:
        reports = super().poll()
        self._last = reports[-1:] or self._last
        return reports or self._last

    def send(self, order: Order) -> None:
        self.coming = [Ended()]


def cruise(rig: Rig) -> tuple[list[tuple[Sample, Phase | None]], Health]:
    """Drive the cruise; give its samples up to the moment that is shown, at the rig's pace, and the bus's health."""
    rows: list[tuple[Sample, Phase | None]] = []
    healths: list[Health] = []
    period = period_ns(rig.period_s)
    server = RigServer(plant_for(rig, []), rig, f"virtual:{uuid.uuid4()}", Address("127.0.0.1", 0))
    with real_time(), server, open_devices(with_addresses(rig, server.bus_url, str(server.modbus))) as devices:
        timing = RunTiming(period)
        watch = HealthWatch(devices, lambda notice: None)

        def observe(sample: Sample, phase: Phase) -> None:
            rows.append((replace(sample, t_ns=sample.cycle * period), phase))
            if phase is Phase.MEASURE and sample.time_s >= SHOWN_S and not healths:
                healths.append(watch.look(plc_health(devices.plc.latest, None), timing))

        plan, nothing = plan_run(rig, "cruise"), Recorded()
        pacer, stop = FreePacer(period), StopRequest()
        run_plan(devices, plan, pacer, nothing, stop, lambda phase, time_s: None, timing, (observe,))
    end = next(k for k, (sample, phase) in enumerate(rows) if phase is Phase.MEASURE and sample.time_s >= SHOWN_S)
    return rows[: end + 1], healths[0]


def main() -> None:
    """Draw them all."""
    rig = read_rig(ROOT / "examples" / "rig.toml")
    rows, health = cruise(rig)
    began = Began("cruise", "runs/cruise-20260321-101500.parquet", rig.experiments["cruise"].duration_s)
    for name, page, size in PICTURES:
        portions = [Samples(tuple(rows[at : at + 10])) for at in range(0, len(rows), 10)]
        source = Played(coming=[Ready(), began, *portions, health])
        state = LiveState(rig.name, rig.period_s, Shaft.of_model(DEFAULT_BUS, "[simulation]"), can_drive=True)
        path = ROOT / "docs" / "images" / f"monitor-{name}.svg"
        MonitorApp(source, state, page=page, picture=(path, 6.0)).run(headless=True, size=size)


if __name__ == "__main__":
    main()
