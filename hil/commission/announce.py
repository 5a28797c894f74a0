"""What a step is about to do, in words and numbers: torque of each inverter, speed, and how long it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hil.commission.predict import Prediction
from hil.commission.registry import STEPS
from hil.commission.step import Job, Step

CONNECT_S = 3.0
"""Opening, configuring, arming and disarming, per run [s]; see docs/benchmarks.md."""

QUESTION_S = 30.0
"""A person reads and answers, per step with torque [s]."""

MOST_VEHICLE_S = 40 * 60
"""A commissioning should not take the vehicle for longer [s]."""


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One run of a plan: what is predicted of it [s, Nm, rad/s]."""

    name: str
    seconds: float
    torque_m1_nm: tuple[float, float]
    torque_m2_nm: tuple[float, float]
    speed_rad_s: tuple[float, float]

    @classmethod
    def of(cls, name: str, prediction: Prediction) -> PlannedRun:
        """Make it from a prediction."""
        m1, m2, speed = prediction.torque_m1_nm, prediction.torque_m2_nm, prediction.speed_rad_s
        return cls(name, prediction.seconds, (m1.low, m1.high), (m2.low, m2.high), (speed.low, speed.high))


def plan_of(job: Job, step: Step) -> list[PlannedRun]:
    """Predict the runs of a step; none where it commands no torque.

    Raises
    ------
    CommandRefused, RunAborted, RigFileError
        If a run could not be driven as it is ordered.
    """
    runs, speed_rad_s = [], job.rolling_rad_s()
    for order in step.orders(job):
        prediction = job.predict(order, speed_rad_s)
        speed_rad_s = prediction.last_rad_s
        runs.append(PlannedRun.of(order.name, prediction))
    return runs


def vehicle_seconds(runs: Sequence[PlannedRun]) -> float:
    """Return how long the vehicle is needed for the runs of one step [s]."""
    return sum(run.seconds + CONNECT_S for run in runs) + (QUESTION_S if runs else 0.0)


def announcement(job: Job, step: Step, runs: Sequence[PlannedRun]) -> list[str]:
    """Return the lines that announce a step."""
    number = [each.name for each in STEPS].index(step.name) + 1
    lines = ["", f"{number}/{len(STEPS)} {step.title} ({step.name})", f"  It {step.about(job)}"]
    if not runs:
        return lines
    width = max(len(run.name) for run in runs)
    lines.append("  predicted, through the torque guard:")
    lines += [
        f"    {run.name:{width}}  {run.seconds:5.1f} s   m1 {_range(run.torque_m1_nm)} Nm   "
        f"m2 {_range(run.torque_m2_nm)} Nm   speed {_range(run.speed_rad_s, 1)} rad/s"
        for run in runs
    ]
    lines.append(f"  {sum(run.seconds for run in runs):.0f} s of driving")
    return lines


def _range(values: tuple[float, float], digits: int = 0) -> str:
    low, high = (round(value, digits) + 0.0 for value in values)
    return f"{low:{6 + digits}.{digits}f} to {high:{4 + digits}.{digits}f}"


def plan_document(job: Job) -> dict[str, Any]:
    """Return the whole plan (schema ``hil.commission_plan/1``), as far as it can be known before."""
    steps: list[dict[str, Any]] = []
    total_s = 0.0
    for step in STEPS:
        runs = plan_of(job, step)
        total_s += vehicle_seconds(runs)
        steps.append(
            {
                "name": step.name,
                "title": step.title,
                "about": f"It {step.about(job)}",
                "status": step.record(job).status.value,
                "runs": [asdict(run) for run in runs],
                "vehicle_s": round(vehicle_seconds(runs), 1),
            }
        )
    return {
        "schema": "hil.commission_plan/1",
        "rig": job.rig.name,
        "steps": steps,
        "vehicle_s": round(total_s, 1),
        "most_vehicle_s": MOST_VEHICLE_S,
    }
