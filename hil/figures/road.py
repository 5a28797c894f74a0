"""Eight experiments on a road: a simulated rig on real protocol stacks, each with its own load, road and driver."""

from __future__ import annotations

import json
import math
import uuid
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from estimator.identification.identify import identify
from estimator.identification.settings import Settings
from estimator.physics.model import DrivelineModel
from estimator.signals.record import Record
from hil.config.experiment_tables import CruiseTable
from hil.config.rig_file import Rig, read_rig
from hil.errors import UsageError
from hil.figures.local_model import TRUTH, LocalModel, Reference, TwoMassLine
from hil.recording import read_record
from hil.recording.writer import RecordingWriter
from hil.rig.build import open_devices
from hil.rig.drive import CycleProgress
from hil.rig.experiments.laws import Cruise
from hil.rig.experiments.registry import experiment_table
from hil.rig.experiments.staged import Approach, LowPass, StagedExperiment, TorqueBounds
from hil.rig.pacing import FreePacer, device_patience_s, period_ns
from hil.rig.plan import Plan, plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.addresses import IN_PROCESS, Address, with_addresses
from hil.simulator.driveline import simulation_model
from hil.simulator.rig_server import RigServer, required_simulation
from hil.version import __version__

PRBS_STATES = 1023
"""States of a ten-cell shift register."""

LAG_S = 0.25
"""Time constant of the foot [s]."""

SHORTEST_S, LONGEST_S = 1.5, 6.0
"""Time between two corrections [s]."""

GRAVITY_M_S2: Final = 9.80665
AIR_KG_M3: Final = 1.2
DRAG_AREA_M2: Final = 5.0
"""c_d A of a city bus: 0.6 to 0.7 times 7.5 to 8 m^2 of front."""

ROLLING: Final = 0.008
"""Rolling resistance of bus tyres on asphalt; those on a test drum have 0.006, a rough road 0.01."""

WAVELENGTHS_M: Final = (90.0, 150.0, 260.0, 410.0)
"""Of the road's rises and falls; no two in a whole ratio."""

GUST_S: Final = 3.0
"""Time over which a gust lasts [s]."""

ROUGHNESS_M: Final = 0.3
"""Distance over which the surface changes [m]: at 8 m/s its corner is at v / 2 pi L = 4 Hz."""

EXPERIMENT = "cruise"

GEAR_RATIO, WHEEL_RADIUS_M = 5.6, 0.48
"""Of the bus that the default model is of (`hil.simulator.driveline.DEFAULT_BUS`)."""

ANY_PORT = Address("127.0.0.1", 0)


@dataclass(frozen=True, slots=True)
class Conditions:
    """One experiment's conditions."""

    speed_rad_s: float  # motor speed that the driver holds [rad/s]
    payload_kg: float  # beyond the mass of the rig file's bus; below 0 it is lighter
    slope_rms: float  # how hilly the road is
    wind_m_s: float  # mean head wind [m/s]
    gust_m_s: float  # standard deviation of its gusts [m/s]
    roughness_nm: float  # RMS of what the road surface adds to the load torque, at the motor shaft [Nm]
    pedal_nm: float  # standard deviation of the driver's corrections by the pedal [Nm]
    prbs_seed: int  # first state of the shift register
    seed: int  # of road, wind, driver and reading noise


def draw_conditions(seed: int, count: int) -> tuple[Conditions, ...]:
    """Draw the conditions of ``count`` experiments; those of the first ones do not depend on how many follow."""
    return tuple(_draw(np.random.default_rng([seed, number])) for number in range(count))


def _draw(rng: np.random.Generator) -> Conditions:
    return Conditions(
        speed_rad_s=float(rng.uniform(65.0, 110.0)),
        payload_kg=float(rng.uniform(-1500.0, 2500.0)),
        slope_rms=float(rng.uniform(0.001, 0.004)),
        wind_m_s=float(rng.uniform(-4.0, 6.0)),
        gust_m_s=float(rng.uniform(0.5, 2.0)),
        roughness_nm=float(rng.uniform(3.0, 12.0)),
        pedal_nm=float(rng.uniform(5.0, 20.0)),
        prbs_seed=int(rng.integers(1, PRBS_STATES + 1)),
        seed=int(rng.integers(2**31)),
    )


class PedalCruise(Cruise):
    """A cruise with a driver whose foot corrects the torque."""

    __slots__ = ("_foot", "_next_s", "_pedal_nm", "_rng", "_wanted_nm")

    def __init__(
        self,
        conditions: Conditions,
        duration_s: float,
        inertia_kg_m2: float,
        torque_limit_nm: float,
        period_s: float,
    ) -> None:
        super().__init__(conditions.speed_rad_s, duration_s, inertia_kg_m2, torque_limit_nm, period_s)
        self._pedal_nm = conditions.pedal_nm
        self._rng = np.random.default_rng([conditions.seed, 1])
        self._foot = LowPass(LAG_S, period_s)
        self._wanted_nm = 0.0
        self._next_s = 0.0

    def torque_nm(self, time_s: float, speed_rad_s: float) -> float:
        """Torque that holds the speed, and that of the driver's foot [Nm]."""
        self._foot.update(self._wanted_nm)
        if time_s >= self._next_s:
            self._wanted_nm = self._pedal_nm * float(self._rng.standard_normal())
            self._next_s += float(self._rng.uniform(SHORTEST_S, LONGEST_S))
        return super().torque_nm(time_s, speed_rad_s) + self._foot.value


@dataclass(frozen=True, slots=True)
class Bus:
    """What of the bus the load torque depends on: its mass [kg] and metres driven per radian of the motor."""

    mass_kg: float  # with its payload
    metres_per_rad: float  # wheel radius over gear ratio


class RoadLoad:
    """The load torque along one drive, asked for once per period."""

    __slots__ = ("_bus", "_conditions", "_gust_m_s", "_phases", "_rng", "_surface_nm")

    def __init__(self, bus: Bus, conditions: Conditions) -> None:
        self._bus = bus
        self._conditions = conditions
        self._rng = np.random.default_rng(conditions.seed)
        self._phases = self._rng.uniform(0.0, 2.0 * np.pi, len(WAVELENGTHS_M))
        self._gust_m_s = 0.0
        self._surface_nm = 0.0

    def torque_nm(self, speed_rad_s: float, distance_m: float, period_s: float) -> float:
        """Return the load torque of the next period [Nm]."""
        v = speed_rad_s * self._bus.metres_per_rad
        given = self._conditions
        self._gust_m_s = self._next(self._gust_m_s, given.gust_m_s, period_s / GUST_S)
        self._surface_nm = self._next(self._surface_nm, given.roughness_nm, abs(v) * period_s / ROUGHNESS_M)
        weight_n = self._bus.mass_kg * GRAVITY_M_S2
        air_m_s = v + given.wind_m_s + self._gust_m_s
        force_n = weight_n * (math.copysign(ROLLING, v) * (v != 0.0) + self._slope(distance_m))
        force_n += 0.5 * AIR_KG_M3 * DRAG_AREA_M2 * air_m_s * abs(air_m_s)
        return force_n * self._bus.metres_per_rad + self._surface_nm

    def _slope(self, distance_m: float) -> float:
        amplitude = self._conditions.slope_rms * math.sqrt(2.0 / len(WAVELENGTHS_M))
        waves = zip(WAVELENGTHS_M, self._phases, strict=True)
        return amplitude * sum(math.sin(2.0 * math.pi * distance_m / length + phase) for length, phase in waves)

    def _next(self, value: float, spread: float, steps: float) -> float:
        """Return the next value of a first-order Markov process, ``steps`` of its scale on."""
        kept = math.exp(-steps)
        return kept * value + spread * math.sqrt(1.0 - kept * kept) * float(self._rng.standard_normal())


class RoadPlant:
    """A two-mass driveline under the load torque of a road."""

    __slots__ = ("_a", "_b", "_distance_m", "_load", "_metres_per_rad", "_period_s", "_x")

    def __init__(
        self, line: TwoMassLine, load: RoadLoad, metres_per_rad: float, speed_rad_s: float, period_s: float
    ) -> None:
        self._a, self._b = line.discrete(period_s)
        self._load = load
        self._metres_per_rad = metres_per_rad
        self._period_s = period_s
        self._distance_m = 0.0
        self._x = np.array([speed_rad_s, speed_rad_s, 0.0])

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""
        return float(self._x[0])

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the driveline run with both torques held [Nm] for one period."""
        if duration_s != self._period_s:
            raise ValueError(
                f"road: asked for a step of {duration_s:g} s, expected the {self._period_s:g} s it was made for. "
                "Make the plant with the rig's own period_s."
            )
        load_speed_rad_s = float(self._x[1])
        load_nm = self._load.torque_nm(load_speed_rad_s, self._distance_m, duration_s)
        self._x = self._a @ self._x + self._b @ np.array([sum(torque_nm), load_nm])
        self._distance_m += load_speed_rad_s * self._metres_per_rad * duration_s


RIG_FILE = Path(__file__).with_name("paper_rig.toml")


@dataclass(frozen=True, slots=True)
class Driven:
    """One experiment that was driven."""

    path: Path  # the recording
    conditions: Conditions  # it was driven under
    line: TwoMassLine  # the driveline as it truly was


def drive(
    path: Path,
    conditions: Conditions,
    duration_s: float,
    stop: StopRequest,
    progress: CycleProgress = lambda phase, time_s: None,
) -> Driven:
    """Drive one experiment on a simulated rig under these conditions, and record it for ``duration_s`` [s]."""
    rig = read_rig(RIG_FILE)
    bus, line = _loaded(rig, conditions)
    load = RoadLoad(bus, conditions)
    plant = RoadPlant(line, load, bus.metres_per_rad, conditions.speed_rad_s, rig.period_s)
    server = RigServer(plant, rig, f"{IN_PROCESS}{uuid.uuid4()}", ANY_PORT, seed=conditions.seed)
    recorder = RecordingWriter(path, _metadata(conditions))
    with server:
        served = with_addresses(rig, server.bus_url, str(server.modbus))
        plan = _plan(served, conditions, duration_s)
        pacer = FreePacer(period_ns(rig.period_s))
        with recorder, open_devices(served, device_patience_s(pacer)) as devices:
            run_plan(devices, plan, pacer, recorder, stop, progress)
    return Driven(path, conditions, line)


def _loaded(rig: Rig, conditions: Conditions) -> tuple[Bus, TwoMassLine]:
    """Load the rig's bus: what turns at the wheels is small besides the mass, which is taken to be all of J_L."""
    values = simulation_model(required_simulation(rig)).values()
    metres_per_rad = WHEEL_RADIUS_M / GEAR_RATIO
    mass_kg = values["J_L"] / metres_per_rad**2 + conditions.payload_kg
    if mass_kg <= 0.0:
        raise UsageError(f"payload {conditions.payload_kg:g} kg: expected less taken out than the bus weighs.")
    loaded = {**values, "J_L": mass_kg * metres_per_rad**2}
    return Bus(mass_kg, metres_per_rad), TwoMassLine.of(loaded)


def _plan(rig: Rig, conditions: Conditions, duration_s: float) -> Plan:
    """Plan the rig file's cruise at these conditions, with a driver in place of a speed hold alone."""
    prbs = rig.prbs.model_copy(update={"seed": conditions.prbs_seed})
    plan = plan_run(rig.model_copy(update={"prbs": prbs}), EXPERIMENT)
    table = experiment_table(rig, EXPERIMENT)
    if not isinstance(table, CruiseTable):
        raise UsageError(f"rig {rig.name!r}, experiments.{EXPERIMENT}: expected kind = 'cruise', got {table.kind!r}")
    inertia, period_s, speed = rig.vehicle.inertia_kg_m2, rig.period_s, conditions.speed_rad_s
    law = PedalCruise(conditions, duration_s, inertia, table.torque_nm, period_s)
    approach = Approach(speed, inertia, table.torque_nm, period_s, table.approach_timeout_s)
    bounds = TorqueBounds(table.torque_nm, table.slew_nm_per_s)
    return replace(plan, experiment=StagedExperiment(law, approach, bounds, period_s))


def _metadata(conditions: Conditions) -> dict[str, str]:
    """Describe the run without a date: the same seed makes the same file."""
    return {
        "hil_version": __version__,
        "experiment": EXPERIMENT,
        "conditions": json.dumps(asdict(conditions)),
        "rig_file": RIG_FILE.read_text(encoding="utf-8"),
    }


def drive_all(
    folder: Path,
    seed: int,
    count: int,
    duration_s: float,
    stop: StopRequest,
    progress: Callable[[int], CycleProgress] = lambda number: lambda phase, time_s: None,
) -> list[Driven]:
    """Drive ``count`` experiments of one seed, ``run_1.csv`` and on."""
    conditions = draw_conditions(seed, count)
    return [
        drive(folder / f"run_{number + 1}.csv", each, duration_s, stop, progress(number))
        for number, each in enumerate(conditions)
    ]


def driven_models(driven: Sequence[Driven], settings: Settings) -> list[LocalModel]:
    """Identify from every experiment that was driven; the truth goes along."""
    models = []
    for each in driven:
        record = read_record(each.path)
        models.append(LocalModel(record, identify(record, settings), Reference(TRUTH, each.line)))
    return models


def recorded_models(
    records: Sequence[Record], settings: Settings, expected: DrivelineModel | None = None
) -> list[LocalModel]:
    """Identify from recordings; next to them what a two-mass model file expects."""
    return [LocalModel.with_expected(record, identify(record, settings), expected) for record in records]
