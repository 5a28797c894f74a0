"""What a step of the commissioning is, and the job it is given to do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from estimator.physics.model import DrivelineModel
from hil.commission.state import CommissioningState, StepFinding, StepRecord, model_from_json
from hil.config.rig_file import Rig
from hil.orders.operator import Answer, Talk
from hil.orders.order import Order, RigSource
from hil.orders.runner import Prediction, Runner, RunRecord, rigid_model

MODEL_STEPS = ("validation", "scales")
"""Steps whose evidence has a ``model``, the better one first."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a step came to: findings and questions for people, evidence for the steps after it and for the report."""

    findings: Sequence[StepFinding]  # in the order in which they are shown
    # what `EVIDENCE` has for the step; NaN and infinity become null in the file
    evidence: Mapping[str, Any] = field(default_factory=dict)
    questions: Sequence[str] = ()  # each has to be answered with yes for the commissioning to continue
    needless: str = ""  # Why there was nothing to do: the step is skipped


@dataclass(slots=True)
class StepContext:
    """What the steps work with."""

    source: RigSource  # the user's rig file, and the addresses in place of its own
    rig: Rig  # what the file says, at these addresses
    state: CommissioningState  # Everything known so far
    runner: Runner  # Drives runs
    nominal: DrivelineModel | None  # The user's own model of the driveline, where there is one
    travel_m_per_rad: float  # Way the vehicle makes per radian of the motor shaft [m]
    travel_is_given: bool  # Whether the user said so; else it is assumed
    say: Callable[[str], None]  # Called with what happens
    progress: Callable[[str, float], None]  # Called during long computations: what, and the share done
    may_command: Callable[[str], Answer] = field(default_factory=lambda: Talk(None).may_command)  # Asks the operator

    @property
    def folder(self) -> Path:
        """Where everything goes."""
        return self.state.folder

    def evidence(self, step: str) -> Mapping[str, Any]:
        """Return a step's evidence; empty where it was not done."""
        return self.state.steps[step].evidence

    def model(self) -> DrivelineModel:
        """Return the best model of the driveline known so far, to predict with."""
        if self.nominal is not None:
            return self.nominal
        for step in MODEL_STEPS:
            if "model" in self.evidence(step):
                return model_from_json(self.evidence(step)["model"])
        return rigid_model(self.rig)

    def predict(self, order: Order, speed_rad_s: float = 0.0) -> Prediction:
        """Predict a run with that model, of a vehicle that rolls at a speed [rad/s]."""
        return self.runner.predict(order, self.model(), speed_rad_s)

    def rolling_rad_s(self) -> float:
        """Speed at the end of the last run [rad/s]; the vehicle may have been braked since."""
        runs = [
            (record.started_utc, i, run) for record in self.state.steps.values() for i, run in enumerate(record.runs)
        ]
        return max(runs, key=lambda each: each[:2])[2].last_rad_s if runs else 0.0

    def run(self, step: str, order: Order) -> RunRecord:
        """Drive a run of a step, or return it where it was already driven whole in this attempt."""
        known = self.state.steps[step].run(order.name)
        if known is not None and known.prbs_nm in (0.0, order.prbs.get("amplitude_nm", known.prbs_nm)):
            return known
        return self.runner.run(step, order, [self.model()], self.rolling_rad_s(), lambda run: self.note(step, run))

    def note(self, step: str, run: RunRecord) -> None:
        """Enter a run in the record of a step, and save the state."""
        self.state.steps[step].runs.append(run)
        self.state.save()

    def recording(self, run: RunRecord) -> Path:
        """Return the path of a run's recording; the folder where it has none."""
        return self.folder / (run.recording or "")

    def runs_of(self, step: str) -> list[RunRecord]:
        """Return the runs of a step's last attempt that came to their end."""
        return [run for run in self.state.steps[step].runs if run.whole]


def _no_orders(job: StepContext) -> Sequence[Order]:
    return ()


@dataclass(frozen=True, slots=True)
class Step:
    """One step."""

    name: str  # As on the command line
    title: str  # As in headings
    about: Callable[[StepContext], str]  # Says what it is about to do
    do: Callable[[StepContext], Outcome]  # Does it
    orders: Callable[[StepContext], Sequence[Order]] = (
        _no_orders  # The runs it will drive; none where it commands no torque
    )
    needs: tuple[str, ...] = ()  # Steps it builds on

    def record(self, job: StepContext) -> StepRecord:
        """Return its record in the state."""
        return job.state.steps[self.name]
