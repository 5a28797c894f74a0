"""The experiments: eight PRBS runs at nearly constant speeds, tip-in and tip-out, and a reversal."""

from __future__ import annotations

import numpy as np

from hil.commission.finding import Finding
from hil.commission.order import Order, as_table
from hil.commission.step import Job, Outcome, Step
from hil.commission.steps.noise import LOST_SHARE
from hil.commission.steps.tables import cruise_of, first_of, halt
from hil.config.experiment_tables import ReversalTable, TipTable

RUNS = 8
"""As many as the paper evaluates together."""

SLOWEST = 0.6
"""Lowest speed, in parts of the rig file's cruise: what depends on speed then shows."""

SEED_STEP = 127
"""From run to run the shift register begins so many states further on (a prime: none comes twice in eight)."""


def _speed_parts() -> list[float]:
    """Return the speeds of the runs, in parts of the cruise's: up and down, so that no run waits long for its speed."""
    up = np.linspace(SLOWEST, 1.0, RUNS // 2).tolist()
    return [*up, *reversed(up)]


def orders(job: Job) -> list[Order]:
    """Order all of them."""
    cruise = cruise_of(job.rig)
    amplitude_nm = job.evidence("prbs").get("amplitude_nm", job.rig.prbs.amplitude_nm)
    seeds = 2**job.rig.prbs.cells - 1
    runs = [
        Order(
            f"cruise{i + 1}",
            as_table(cruise, speed_rad_s=part * cruise.speed_rad_s, prbs=True),
            {"amplitude_nm": amplitude_nm, "seed": (job.rig.prbs.seed - 1 + i * SEED_STEP) % seeds + 1},
        )
        for i, part in enumerate(_speed_parts())
    ]
    for name, table in _others(job):
        if table is not None:
            runs.append(Order(name, as_table(table, prbs=True), {"amplitude_nm": amplitude_nm}, least_margin_rad_s=4.0))
    return [*runs, halt(job.rig)]


def _others(job: Job) -> list[tuple[str, TipTable | ReversalTable | None]]:
    """Return what is driven next to the runs at constant speed; None where the rig file has none of its kind."""
    return [("tip", first_of(job.rig, TipTable)), ("reversal", first_of(job.rig, ReversalTable))]


def _about(job: Job) -> str:
    amplitude_nm = job.evidence("prbs").get("amplitude_nm", job.rig.prbs.amplitude_nm)
    speed = cruise_of(job.rig).speed_rad_s
    return (
        f"drives {RUNS} runs of {cruise_of(job.rig).duration_s:g} s at {SLOWEST * speed:g} to {speed:g} rad/s with a "
        f"PRBS of ±{amplitude_nm:g} Nm, then tip-in and tip-out, then a reversal, and brings the vehicle to a stand. A "
        "run that is interrupted is driven again; those before it are kept."
    )


def _do(job: Job) -> Outcome:
    asked = orders(job)
    for number, order in enumerate(asked, start=1):
        job.say(f"  {number} of {len(asked)}: {order.name}")
        job.run("experiments", order)
    runs = job.runs_of("experiments")
    flagged, recorded = sum(run.flagged for run in runs), sum(run.recorded for run in runs)
    share = flagged / max(1, recorded)
    missing = [name for name, table in _others(job) if table is None]
    findings = [
        Finding("runs recorded", str(len(asked)), str(len(runs)), len(runs) == len(asked)),
        Finding(
            "samples stale or late",
            f"at most {100.0 * LOST_SHARE:g} %",
            f"{100.0 * share:.2f} % of {recorded}",
            share <= LOST_SHARE,
            "Close other programs; look at bus load and cabling",
        ),
        *(
            Finding(name, f"an experiment of kind {name!r} in the rig file", "none", None, f"Add [experiments.{name}]")
            for name in missing
        ),
    ]
    return Outcome(findings, {"recordings": {run.name: run.recording for run in runs}})


STEP = Step("experiments", "Experiments", _about, _do, orders, needs=("prbs",))
