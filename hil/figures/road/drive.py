"""The experiments on the simulated rig: real protocol stacks at both ends, each with a bus and road of its own."""

from __future__ import annotations

import json
import uuid
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from hil import __version__
from hil.config.experiment_tables import CruiseTable
from hil.config.rig_file import Rig, read_rig
from hil.errors import UsageError
from hil.figures.line import TwoMassLine
from hil.figures.road.conditions import Conditions
from hil.figures.road.pedal import PedalCruise
from hil.figures.road.road_load import Bus, RoadLoad
from hil.figures.road.road_plant import RoadPlant
from hil.recording.writer import RecordingWriter
from hil.rig.addresses import with_addresses
from hil.rig.build import open_devices
from hil.rig.drive import Progress
from hil.rig.experiments.approach import Approach
from hil.rig.experiments.cruise import Cruise
from hil.rig.experiments.registry import experiment_table
from hil.rig.experiments.staged import StagedExperiment, TorqueBounds
from hil.rig.pacing import FreePacer, heartbeat_patience_ms, period_ns
from hil.rig.plan import Plan, plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.simulator.loopback import IN_PROCESS, Address
from hil.simulator.rig_server import RigServer, required_simulation
from hil.simulator.simulation_model import simulation_model

RIG_FILE = Path(__file__).with_name("paper_rig.toml")

EXPERIMENT = "cruise"

GEAR_RATIO, WHEEL_RADIUS_M = 5.6, 0.48
"""Of the bus that the default model is of (`hil.simulator.simulation_model.DEFAULT_BUS`)."""

ANY_PORT = Address("127.0.0.1", 0)


@dataclass(frozen=True, slots=True)
class Driven:
    """One experiment that was driven.

    Attributes
    ----------
    path
        The recording.
    conditions
        It was driven under.
    line
        The driveline as it truly was.
    """

    path: Path
    conditions: Conditions
    line: TwoMassLine


def drive(
    path: Path,
    conditions: Conditions,
    duration_s: float,
    stop: StopRequest,
    progress: Progress = lambda phase, time_s: None,
) -> Driven:
    """Drive one experiment and record it."""
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
        with recorder, open_devices(served, heartbeat_patience_ms(pacer)) as devices:
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
    cruise = Cruise(speed, duration_s, inertia, table.torque_nm, period_s)
    law = PedalCruise(cruise, conditions.pedal_nm, period_s, np.random.default_rng([conditions.seed, 1]))
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
