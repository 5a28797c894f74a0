"""A small rig for tests: the example's, with short experiments, a light vehicle and no noise."""

import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.config.rig_file import Rig, read_rig
from hil.rig.build import Devices, open_devices
from hil.rig.drive import CycleProgress, RunSummary
from hil.rig.pacing import FREE_PATIENCE_S, FreePacer, Pacer, device_patience_s, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.sample import Sample
from hil.simulator.addresses import Address, with_addresses
from hil.simulator.faults import RigFaults
from hil.simulator.plc_device import PlcDevice
from hil.simulator.rig_server import RigServer
from tests.simulator.rigid_plant import RigidPlant

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"
INERTIA_KG_M2 = 10.0
DRAG_NM_S = 0.5
DURATION_S = 1.0
ANY_PORT = Address("127.0.0.1", 0)

CHANGES = {
    "inverters.m1": {"host_timeout_ms": 1000},  # a test machine may be busy
    "inverters.m2": {"host_timeout_ms": 1000},
    "vehicle": {"inertia_kg_m2": INERTIA_KG_M2},
    "experiments.cruise": {"duration_s": DURATION_S, "speed_rad_s": 0.4, "approach_timeout_s": 20.0},
    "experiments.reversal": {"duration_s": DURATION_S, "turning_speed_rad_s": 2.0, "swing_nm": 200.0},
    "simulation": {"speed_noise_rad_s": 0.0, "torque_noise_permille": 0.0},
}


def changed(table: Any, changes: dict[str, dict[str, object]]) -> Any:
    """Change keys of tables of a rig, by dotted name of the table; the file's own checks are not repeated."""
    for name, values in changes.items():
        table = _changed(table, name.split("."), values)
    return table


def _changed(table: Any, path: list[str], values: dict[str, object]) -> Any:
    if not path:
        return table.model_copy(update=values)
    if isinstance(table, dict):
        return {**table, path[0]: _changed(table[path[0]], path[1:], values)}
    return table.model_copy(update={path[0]: _changed(getattr(table, path[0]), path[1:], values)})


def small_rig() -> Rig:
    rig: Rig = changed(read_rig(EXAMPLE), CHANGES)
    return rig


@dataclass
class Samples:
    """A recording in memory."""

    rows: list[Sample] = field(default_factory=list)

    def append(self, sample: Sample) -> None:
        self.rows.append(sample)

    def column(self, name: str) -> list[float]:
        return [getattr(row, name) for row in self.rows]


@contextmanager
def served(
    rig: Rig | None = None, faults: RigFaults | None = None, plc: PlcDevice | None = None, bus_url: str | None = None
) -> Iterator[tuple[RigServer, Rig]]:
    """Serve a rig from this process; yields the server, and the rig at the server's addresses."""
    rig = rig or small_rig()
    plant = RigidPlant(INERTIA_KG_M2, DRAG_NM_S)
    server = RigServer(plant, rig, bus_url or f"virtual:{uuid.uuid4()}", ANY_PORT, faults)
    server.plc = plc or server.plc
    with server:
        yield server, with_addresses(rig, server.bus_url, str(server.modbus))


def addresses(server: RigServer) -> tuple[str, ...]:
    """Options with which a command finds a rig that is served here."""
    return ("--bus", server.bus_url, "--modbus", str(server.modbus))


def fast(rig: Rig, answer_timeout_s: float = FREE_PATIENCE_S) -> FreePacer:
    return FreePacer(period_ns(rig.period_s), answer_timeout_s)


def run(
    rig: Rig,
    devices: Devices,
    samples: Samples,
    experiment: str = "cruise",
    pacer: Pacer | None = None,
    stop: StopRequest | None = None,
    progress: CycleProgress = lambda phase, time_s: None,
) -> RunSummary:
    """Run an experiment into memory, as fast as the simulated rig answers."""
    plan = plan_run(rig, experiment)
    return run_plan(devices, plan, pacer or fast(rig), samples, stop or StopRequest(), progress)


def run_once(rig: Rig, samples: Samples, **arguments: Any) -> RunSummary:
    """Open the devices, run, close them."""
    pacer = arguments.setdefault("pacer", fast(rig))
    with open_devices(rig, device_patience_s(pacer)) as devices:
        return run(rig, devices, samples, **arguments)
