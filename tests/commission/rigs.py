"""A commissioning on a simulated rig in this process, with whatever is wrong with it."""

import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from hil.commission.engine import NAMES, Commissioning, StepRequests
from hil.commission.state import CommissioningState, StepFinding, StepRecord, load_state
from hil.commission.step import Step, StepContext
from hil.config.rig_file import read_rig
from hil.orders.operator import Talk
from hil.orders.order import RigSource
from hil.orders.runner import Conditions, Runner
from hil.rig.pacing import FreePacer, period_ns
from hil.rig.realtime import NOT_ASKED
from hil.simulator.addresses import Address
from hil.simulator.driveline import EffectSpec, plant_for
from hil.simulator.fault_table import rig_faults
from hil.simulator.rig_server import RigServer
from hil.simulator.simulated_rig import SimulatedPlant

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"


@dataclass
class Miswired:
    """A driveline on which inverter m2 turns the other way."""

    plant: SimulatedPlant

    @property
    def speed_rad_s(self) -> float:
        return self.plant.speed_rad_s

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        self.plant.advance((torque_nm[0], -torque_nm[1]), duration_s)


@dataclass
class Bench:
    """A served rig and one commissioning on it; every `call` is one call of the command."""

    server: RigServer
    source: RigSource
    folder: Path
    said: list[str] = field(default_factory=list)
    shown: list[StepFinding] = field(default_factory=list)

    def job(self) -> StepContext:
        rig = self.source.rig()
        state = load_state(self.folder, NAMES) or CommissioningState(
            self.folder, rig.name, str(self.source.path), self.source.text, {name: StepRecord() for name in NAMES}
        )
        conditions = Conditions(
            "fast",
            lambda rig: FreePacer(period_ns(rig.period_s), 2.0),
            lambda: nullcontext(NOT_ASKED),
            lambda plan: nullcontext(lambda phase, time_s: None),
        )
        runner = Runner(self.source, self.folder, conditions)
        return StepContext(
            self.source, rig, state, runner, None, 0.0857, False, self.said.append, lambda stage, share: None
        )

    def call(self, *steps: str, talk: Talk | None = None, repeat: Sequence[str] = ()) -> CommissioningState:
        """Do these steps; the others are skipped."""
        skip = {name: "not under test" for name in NAMES if name not in steps}
        job = self.job()

        def show(step: Step, findings: list[StepFinding]) -> None:
            self.shown += findings

        Commissioning(job, talk or Talk(None, True), StepRequests(skip, frozenset(repeat)), show).run()
        return job.state

    def finding(self, what: str) -> StepFinding:
        """Return the latest finding of this name."""
        return next(finding for finding in reversed(self.shown) if finding.what == what)


@contextmanager
def bench(
    folder: Path,
    changes: Sequence[tuple[str, str]] = (),
    effects: Sequence[str] = (),
    faults: Sequence[str] = (),
    miswired: bool = False,
) -> Iterator[Bench]:
    """Serve the example rig, changed."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in (("feedback_timeout_s = 0.2", "feedback_timeout_s = 2.0"), *changes):
        assert text.count(before) >= 1, before
        text = text.replace(before, after)
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    rig = read_rig(path)
    plant: SimulatedPlant = plant_for(rig, [EffectSpec.parse(effect) for effect in effects])
    plant = Miswired(plant) if miswired else plant
    faulty = rig_faults(faults, rig.period_s)
    with RigServer(plant, rig, f"virtual:{uuid.uuid4()}", Address("127.0.0.1", 0), faulty) as server:
        out = folder / "out"
        out.mkdir(exist_ok=True)
        yield Bench(server, RigSource(path, text, server.bus_url, str(server.modbus)), out)
