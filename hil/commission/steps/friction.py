"""Friction: back and forth through standstill, without a PRBS; inertia, dry and viscous friction, constant load."""

from __future__ import annotations

import numpy as np

from hil.commission.analysis.measured import Measured
from hil.commission.finding import Finding, stated
from hil.commission.order import Order, as_table
from hil.commission.readings import record_of, thinned
from hil.commission.step import Job, Outcome, Step
from hil.commission.steps.tables import first_of
from hil.config.experiment_tables import ReversalTable

INERTIA = (0.7, 1.3)
"""Inertia over that of the rig file: it tunes the speed holds, which 30 % leave sound (phase margin 67 degrees)."""

FRICTION_SHARE = 0.5
"""Largest dry friction, in parts of the torque of the reversal: beyond, the vehicle hardly turns round."""

LOAD_SHARE = 0.2
"""Largest constant load (grade), in parts of that torque."""


def _orders(job: Job) -> list[Order]:
    table = first_of(job.rig, ReversalTable)
    if table is None:
        return []
    return [Order("reversal", as_table(table, prbs=False), least_margin_rad_s=4.0)]


def _about(job: Job) -> str:
    table = first_of(job.rig, ReversalTable)
    if table is None:
        return "needs an experiment of kind 'reversal' in the rig file, there is none: nothing is driven."
    return (
        f"swings the vehicle back and forth by ±{table.swing_nm:g} Nm, turning at ±{table.turning_speed_rad_s:g} "
        "rad/s, without a PRBS."
    )


def _do(job: Job) -> Outcome:
    table, orders = first_of(job.rig, ReversalTable), _orders(job)
    if table is None:
        return Outcome([_missing()])
    record = record_of(job.recording(job.run("friction", orders[0])))
    from hil.commission.analysis.physical_fit import fit_rigid  # a second, and the bus comes first

    fit = fit_rigid([record], job.rig.vehicle.inertia_kg_m2)
    inertia, dry = fit.parameters["J_M"], fit.parameters["friction_nm"]
    viscous, load = fit.parameters["b_M"], fit.load_nm[record.name]
    assumed = job.rig.vehicle.inertia_kg_m2
    relative = Measured(inertia.value / assumed, inertia.ci95 / assumed)
    swing = table.swing_nm
    findings = [
        Finding(
            "total inertia at the motor shaft",
            f"{assumed:g} kg m² as in the rig file, within {INERTIA[0] - 1:+.0%} to {INERTIA[1] - 1:+.0%}",
            inertia.shown("kg m²"),
            relative.is_within(*INERTIA),
            f"Set [vehicle] inertia_kg_m2 = {inertia.value:.3g}: it tunes the speed holds",
        ),
        Finding(
            "dry friction",
            f"at most {FRICTION_SHARE * swing:g} Nm, half of the swing",
            dry.shown("Nm"),
            dry.is_within(-np.inf, FRICTION_SHARE * swing),
            "Look for a brake that drags, or raise swing_nm of the reversal",
        ),
        stated("viscous friction", viscous.shown("Nm s/rad")),
        Finding(
            "constant load (grade)",
            f"within ±{LOAD_SHARE * swing:g} Nm, a fifth of the swing",
            load.shown("Nm"),
            load.is_within(-LOAD_SHARE * swing, LOAD_SHARE * swing),
            "Repeat on a level road",
        ),
    ]
    drawn = thinned(record.time_s, record.total_torque_nm, record.output)
    evidence = {
        "inertia_kg_m2": [inertia.value, inertia.ci95],
        "dry_nm": [dry.value, dry.ci95],
        "viscous_nm_s": [viscous.value, viscous.ci95],
        "load_nm": [load.value, load.ci95],
        "rms_rad_s": fit.rms,
        "course": dict(zip(("time_s", "torque_nm", "speed_rad_s"), drawn, strict=True)),
    }
    return Outcome(findings, evidence)


def _missing() -> Finding:
    return Finding(
        "reversal",
        "an experiment of kind 'reversal' in the rig file",
        "none",
        None,
        "Add [experiments.reversal]; without it dry friction can't be distinguished from a grade",
    )


STEP = Step("friction", "Friction and reversal", _about, _do, _orders, needs=("signs",))
