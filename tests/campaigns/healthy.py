"""``python -m tests.campaigns.healthy``: runs in which nothing is wrong; none may be ended by the supervision.

Drawn: the vehicle's mass (half to one and a half times the rig file's), its line, gap and friction, a road whose grade
changes with the way (up to 6 %, and to 60 % of what the experiment's torque climbs; level for pulses and rest), waves
in it, wind, every kind of experiment, both torque modes, PRBS by host and PLC, 0 to 3 % lost PDOs, a host that is late,
speeds from 3 to 80 rad/s, a resolver's noise up to three times as large, and two drives of different makes: other
filters of the speed, other steps of the torque, a clock of its own; half of them read a speed below 0.3 rad/s as zero,
and begin on the level. A run that this machine was too busy for is counted
by itself.

An approach ends where the speed has become steady, which it does not in gusts or where the grade changes. So in three
of four runs the air is still and the grade as it begins until the measured part does; in the fourth the approach may
end by itself, and is counted by itself.
"""

from __future__ import annotations

import math
import sys
import tempfile
import uuid
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from drivers.errors import DriverError
from drivers.inverter.cia402 import TorqueMode
from drivers.plc.types import PrbsSource
from hil.config.rig_file import Rig
from hil.errors import RunAborted
from hil.rig.build import open_devices
from hil.rig.experiments.base import Phase
from hil.rig.pacing import FREE_PATIENCE_S, FreePacer, Tick, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.fault_table import rig_faults
from hil.simulator.inverter_node import InverterNode
from hil.simulator.rig_server import RigServer
from tests.campaigns.faults.rig import campaign_rig
from tests.campaigns.faults.runs import asked_for
from tests.rig.serving import Samples, changed

INERTIA_KG_M2 = 100.0
TRAVEL_M_PER_RAD = 0.086
GRAVITY_M_S2 = 9.81
TORQUE_NM = 1000.0  # of the experiments, both inverters together
STEPS = 10  # of integration in a cycle
SHARPEST_M = 300.0
"""Least radius of a crest or sag: 0.33 % of grade per metre, as in a street of a town."""

LEAST_LAG_S = 0.001  # of a drive's filter of its speed
BUSY = "too busy"
OWN_END = ("approach", "standstill test")
"""How an experiment ends that does not get where it should: by itself, and not by the supervision."""


class Road:
    """The grade over the way, curved with radii of `SHARPEST_M` and more, and waves."""

    def __init__(self, rng: np.random.Generator, most: float) -> None:
        lengths = rng.uniform(5.0, 40.0, 400)
        self._at_m = np.concatenate([[0.0], np.cumsum(lengths)])
        grades = [float(rng.uniform(-most, most))]
        for length_m, bend in zip(lengths.tolist(), rng.uniform(-1.0, 1.0, lengths.size).tolist(), strict=True):
            grades.append(min(max(grades[-1] + bend * length_m / SHARPEST_M, -most), most))
        self._grades = np.array(grades)
        self._wave, self._length_m = rng.uniform(0.0, 0.002), rng.uniform(0.5, 5.0)

    def begin_level(self) -> None:
        """Have no grade where the run begins."""
        self._grades -= self._grades[0]

    def grade(self, way_m: float) -> float:
        way_m = abs(way_m)
        waves = bool(self._grades.any()) * self._wave * math.sin(2.0 * math.pi * way_m / self._length_m)
        return float(np.interp(way_m, self._at_m, self._grades)) + waves


class Vehicle:
    """Motor and vehicle on a shaft with a gap, on a road, in the wind."""

    def __init__(self, rng: np.random.Generator, level: bool) -> None:
        self.mass = float(rng.uniform(0.5, 1.5))
        self._motor = float(rng.uniform(1.0, 3.0))
        self._body = self.mass * INERTIA_KG_M2 - self._motor
        self._k, self._c = float(rng.uniform(2000.0, 6000.0)), float(rng.uniform(3.0, 15.0))
        self.calm = bool(rng.random() < 0.75)
        self._gap = 0.5 * float(rng.uniform(0.0, 0.05)) * bool(rng.random() < 0.5)
        weight_nm = self.mass * INERTIA_KG_M2 * GRAVITY_M_S2 / TRAVEL_M_PER_RAD
        self._weight_nm, self._friction_nm = weight_nm, weight_nm * float(rng.uniform(0.004, 0.01))
        self.road = Road(rng, 0.0 if level else min(0.06, 0.6 * TORQUE_NM / weight_nm))
        self._wind_nm, self._gusts_nm, self._rng = 0.0, float(rng.uniform(0.0, 15.0)), rng
        self._speeds, self._twist, self._way_m = [0.0, 0.0], 0.0, 0.0

    @property
    def speed_rad_s(self) -> float:
        return self._speeds[0]

    def follow(self, phase: Phase, time_s: float) -> None:
        """See the run begin its measured part: from there on the grade changes and the wind blows."""
        self.calm &= phase is Phase.APPROACH

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        gust_nm = 0.0 if self.calm else self._gusts_nm * math.sqrt(duration_s) * self._rng.normal()
        self._wind_nm += -self._wind_nm * duration_s / 3.0 + gust_nm
        load_nm = self._wind_nm + self._weight_nm * self.road.grade(self._way_m)
        step_s, total_nm = duration_s / STEPS, sum(torque_nm)
        motor, body = self._speeds
        for _ in range(STEPS):
            beyond = self._twist - max(-self._gap, min(self._gap, self._twist))
            shaft_nm = self._k * beyond + (self._c * (motor - body) if beyond or not self._gap else 0.0)
            motor += step_s * (total_nm - shaft_nm) / self._motor
            body += step_s * (shaft_nm - load_nm) / self._body
            rubbed = step_s * self._friction_nm / self._body  # dry friction: it stops, and does not turn
            body = 0.0 if abs(body) <= rubbed else body - math.copysign(rubbed, body)
            self._twist += step_s * (motor - body)
            self._way_m += 0.0 if self.calm else step_s * body * TRAVEL_M_PER_RAD
        self._speeds = [motor, body]


class LatePacer(FreePacer):
    """A host that is late now and then, by up to three periods."""

    def __init__(self, period: int, rng: np.random.Generator, share: float) -> None:
        super().__init__(period, FREE_PATIENCE_S)
        self.answer_timeout_s = 0.002  # of the wall clock: drives answer within the call that sends the SYNC
        self._rng, self._share, self._slept = rng, share, 0

    def next(self) -> Tick:
        tick = super().next()
        late_ns = int(self._rng.uniform(0.0, 3.0) * self.period_ns) if self._rng.random() < self._share else 0
        slept, self._slept = self._slept, self._slept + late_ns // self.period_ns
        return Tick(tick.cycle + slept, tick.due_ns + slept * self.period_ns, late_ns)


def experiments(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """One of each kind, at a random speed."""
    speed = float(np.exp(rng.uniform(np.log(3.0), np.log(80.0))))
    common = {"torque_nm": TORQUE_NM, "share_m1": 0.5, "slew_nm_per_s": 2000.0, "duration_s": 6.0}
    common["approach_timeout_s"] = 60.0
    return {
        "cruise": {**common, "speed_rad_s": speed},
        "tip": {**common, "speed_rad_s": speed, "step_nm": 300.0, "step_s": float(rng.uniform(0.3, 2.0))},
        "reversal": {**common, "turning_speed_rad_s": float(rng.uniform(2.0, 8.0)), "swing_nm": 600.0},
        "pulses": {"step_nm": float(rng.uniform(50.0, 400.0)), "duration_s": 6.0, "most_speed_rad_s": 30.0},
        "rest": {"duration_s": 6.0},
    }


def drawn_rig(rng: np.random.Generator, rig: Rig, name: str) -> tuple[Rig, list[str]]:
    """Draw a rig and what its drives are like, for one experiment."""
    usual = {"torque_limit_nm": 600.0, "heartbeat_ms": 1000, "host_timeout_ms": 5000}  # beats go by the wall clock
    inverters: dict[str, dict[str, object]] = {"m1": dict(usual), "m2": dict(usual)}
    if rng.random() < 0.4:
        sloped = {
            "mode": TorqueMode.PROFILE_TORQUE,
            "torque_slope_nm_per_s": float(rng.choice([700.0, 2500.0, 8000.0])),
        }
        for table in inverters.values():
            table.update(sloped)
    source = PrbsSource.PLC if rng.random() < 0.3 else PrbsSource.HOST
    changes: dict[str, dict[str, object]] = {
        **{f"inverters.{drive}": table for drive, table in inverters.items()},
        "guard": {"sum_limit_nm": 1200.0},
        "prbs": {"source": source, "clock_divider": int(rng.integers(1, 6))},
        "simulation": {"speed_noise_rad_s": float(rng.uniform(0.02, 0.15)), "torque_noise_permille": 1.0},
        "vehicle": {"travel_m_per_rad": TRAVEL_M_PER_RAD},
        f"experiments.{name}": experiments(rng)[name],
    }
    faults = [f"bus.lose={rng.uniform(0.01, 0.03):.4f}"] if rng.random() < 0.5 else []
    faults += [f"m2.coarse_torque={rng.integers(2, 8)}"] if rng.random() < 0.5 else []
    faults += [f"m1.clock_drift={rng.integers(-300, 300)}"] if rng.random() < 0.5 else []
    made: Rig = changed(rig, changes)
    return made, faults


class SpeedReading:
    """How a drive reads its speed: through a filter, and as zero within a window around it."""

    def __init__(self, lag_s: float, window_rad_s: float, period_s: float) -> None:
        self._left, self._window_rad_s = math.exp(-period_s / lag_s), window_rad_s
        self._filtered_rad_s = 0.0

    def filtered(self, speed_rad_s: float) -> float:
        """Take the speed of the next cycle [rad/s]."""
        self._filtered_rad_s = speed_rad_s + self._left * (self._filtered_rad_s - speed_rad_s)
        return self._filtered_rad_s

    def shown(self, reading_rad_s: float) -> float:
        return 0.0 if abs(reading_rad_s) < self._window_rad_s else reading_rad_s

    def have(self, node: InverterNode | None) -> None:
        """Have a simulated drive read so."""
        assert node is not None
        sensors = node._device._sensors
        sample, scale = sensors.sample, sensors._velocity_scale

        def read(speed_rad_s: float, torque: float, step: int) -> None:
            sample(self.filtered(speed_rad_s), torque, step)
            sensors.speed = scale.to_raw(self.shown(scale.to_rad_s(sensors.speed)), "reading")

        sensors.sample = read  # type: ignore[method-assign]


def healthy_run(rig: Rig, seed: tuple[int, int]) -> tuple[str, str, str]:
    """Drive one; give kind, what was drawn, and what ended it: empty where it went to its last row."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(["cruise", "tip", "reversal", "pulses", "rest"]))
    made, faults = drawn_rig(rng, rig, name)
    vehicle, lag_s = Vehicle(rng, level=name in ("pulses", "rest")), float(rng.uniform(LEAST_LAG_S, 0.03))
    late, window_rad_s = float(rng.choice([0.0, 0.003])), float(rng.choice([0.0, 0.3]))
    if window_rad_s:
        vehicle.road.begin_level()  # it can't be distinguished from a dead reading before it has moved
    mode = made.inverters.m1.mode.name.lower()
    what = f"mass {vehicle.mass:.2f}, PRBS {made.prbs.source.value}, {mode}, {', '.join(faults)}, host late {late}"
    what += f", zero window {window_rad_s}"
    server = RigServer(
        vehicle, made, f"virtual:{uuid.uuid4()}", Address("127.0.0.1", 0), rig_faults(faults, made.period_s)
    )
    with server:
        for node, filter_s in ((server._slaves._m1, LEAST_LAG_S), (server._slaves._m2, lag_s)):
            SpeedReading(filter_s, window_rad_s, made.period_s).have(node)
        at = with_addresses(made, server.bus_url, str(server.modbus))
        try:
            with open_devices(at, FREE_PATIENCE_S) as devices:
                pacer = LatePacer(period_ns(at.period_s), rng, late)
                run_plan(devices, plan_run(at, name), pacer, Samples(), StopRequest(), vehicle.follow)
        except (DriverError, RunAborted) as error:
            return name, what, str(error)
    return name, what, ""


def main(arguments: list[str] | None = None) -> int:
    """Drive them and print the table; 1 if the supervision ended one."""
    asked = asked_for("tests.campaigns.healthy", 1000, arguments)
    counts: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as folder, suppress(KeyboardInterrupt):
        rig = campaign_rig(Path(folder), inertia_kg_m2=INERTIA_KG_M2)
        for number in range(asked.first, asked.first + asked.runs):
            name, what, said = healthy_run(rig, (asked.seed, number))
            result = "busy" if BUSY in said else "approach" if said.startswith(OWN_END) else "ended" if said else ""
            counts[name, "runs"] += 1
            counts[name, result] += 1
            if said:
                print(f"run {number}: {name}, {what}: {said[:400]}", file=sys.stderr, flush=True)
    print("| experiment | runs | approach did not settle | machine too busy | ended by supervision |")
    print("| --- | --- | --- | --- | --- |")
    for name in sorted({each for each, _ in counts}):
        print(
            "| " + " | ".join([name, *(str(counts[name, key]) for key in ("runs", "approach", "busy", "ended"))]) + " |"
        )
    return int(any(result == "ended" for _, result in counts))


if __name__ == "__main__":
    sys.exit(main())
