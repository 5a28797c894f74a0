"""Noise of every reading at rest, and the friction and inertia of the driveline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hil.commission.responses import READING, Measured, columns_of, record_of, thinned
from hil.commission.state import StepFinding, stated
from hil.commission.step import Outcome, Step, StepContext
from hil.config.experiment_tables import ReversalTable
from hil.orders.order import Order, as_table, first_of
from hil.orders.runner import RunRecord
from hil.recording.columns import FLAGS, SPEED, TIME
from hil.report.numbers import shown

DURATION_S = 10.0

SPEED_NOISE_RAD_S = 0.2
"""Largest speed noise [rad/s RMS]: four times what DESIGN assumes; the PRBS that is needed grows with it."""

OFFSET_RAD_S = 0.05
"""Largest mean speed of a vehicle that stands [rad/s]: what an approach calls steady."""

TORQUE_PERMILLE = 2.0
"""Largest mean and noise of a torque reading at zero torque, in per mille of rated: twice its resolution."""

LOST_SHARE = 0.01
"""Largest share of samples that are stale or late."""

INERTIA = (0.7, 1.3)
"""Inertia over that of the rig file: it tunes the speed holds, which 30 % leave sound (phase margin 67 degrees)."""

FRICTION_SHARE = 0.5
"""Largest dry friction, in parts of the torque of the reversal: beyond, the vehicle hardly turns round."""

LOAD_SHARE = 0.2
"""Largest constant load (grade), in parts of that torque."""


def _orders_noise(job: StepContext) -> list[Order]:
    return [Order("rest", {"kind": "rest", "duration_s": DURATION_S})]


def _about_noise(job: StepContext) -> str:
    return (
        f"records {DURATION_S:g} s at standstill with the drives armed at zero torque. Nothing is asked for but zero; "
        "the brakes may stay on."
    )


def _do_noise(job: StepContext) -> Outcome:
    run = job.run("noise", _orders_noise(job)[0])
    columns = columns_of(job.recording(run))
    good = columns[FLAGS] == 0
    speed = columns[SPEED][good]
    mean, std = float(np.mean(speed)), float(np.std(speed))
    findings = [
        StepFinding(
            "speed noise (RMS)",
            f"at most {SPEED_NOISE_RAD_S:g} rad/s",
            shown(std, "rad/s"),
            std <= SPEED_NOISE_RAD_S,
            "Look at the resolver's cable and shield, and at the drive's speed filter; a larger PRBS makes up for it",
        ),
        StepFinding(
            "mean speed",
            f"within ±{OFFSET_RAD_S:g} rad/s",
            shown(mean, "rad/s"),
            abs(mean) <= OFFSET_RAD_S,
            "The vehicle rolls, or the speed has an offset: brake it and repeat; then look at the resolver",
        ),
        *(_torque_finding(job, name, columns[READING[name]][good]) for name in READING),
        samples_lost([run]),
    ]
    evidence = {
        "speed_std_rad_s": std,
        "speed_mean_rad_s": mean,
        "course": dict(zip(("time_s", "speed_rad_s"), thinned(columns[TIME], columns[SPEED]), strict=True)),
    }
    return Outcome(findings, evidence)


def _torque_finding(job: StepContext, name: str, reading: np.ndarray) -> StepFinding:
    rated = getattr(job.rig.inverters, name).rated_torque_nm
    mean, std = (1000.0 * float(f(reading)) / rated for f in (np.mean, np.std))
    return StepFinding(
        f"torque reading of {name}",
        f"mean within ±{TORQUE_PERMILLE:g} ‰ of rated, noise at most {TORQUE_PERMILLE:g} ‰",
        f"mean {mean:z.2f} ‰, noise {std:.2f} ‰",
        abs(mean) <= TORQUE_PERMILLE and std <= TORQUE_PERMILLE,
        f"Calibrate the current sensors of {name}, or look for a torque it gives by itself",
    )


def samples_lost(runs: Sequence[RunRecord]) -> StepFinding:
    """Hold what was stale or late in some runs against its limit."""
    recorded = sum(run.recorded for run in runs)
    share = sum(run.flagged for run in runs) / max(1, recorded)
    return StepFinding(
        "samples stale or late",
        f"at most {100.0 * LOST_SHARE:g} %",
        f"{100.0 * share:.2f} % of {recorded}",
        share <= LOST_SHARE,
        "Close other programs, look at the bus load and cabling; see docs/benchmarks.md for what a machine can do",
    )


NOISE = Step("noise", "Noise at standstill", _about_noise, _do_noise, _orders_noise, needs=("devices",))


def _orders_friction(job: StepContext) -> list[Order]:
    table = first_of(job.rig, ReversalTable)
    if table is None:
        return []
    return [Order("reversal", as_table(table, prbs=False), least_margin_rad_s=4.0)]


def _about_friction(job: StepContext) -> str:
    table = first_of(job.rig, ReversalTable)
    if table is None:
        return "needs an experiment of kind 'reversal' in the rig file, there is none: nothing is driven."
    return (
        f"swings the vehicle back and forth by ±{table.swing_nm:g} Nm, turning at ±{table.turning_speed_rad_s:g} "
        "rad/s, without a PRBS."
    )


def _do_friction(job: StepContext) -> Outcome:
    table, orders = first_of(job.rig, ReversalTable), _orders_friction(job)
    if table is None:
        return Outcome([_missing()])
    record = record_of(job.recording(job.run("friction", orders[0])))
    from hil.commission.physical_fit import fit_rigid  # a second, and the bus comes first

    fit = fit_rigid([record], job.rig.vehicle.inertia_kg_m2)
    inertia, dry = fit.parameters["J_M"], fit.parameters["friction_nm"]
    viscous, load = fit.parameters["b_M"], fit.load_nm[record.name]
    assumed = job.rig.vehicle.inertia_kg_m2
    relative = Measured(inertia.value / assumed, inertia.ci95 / assumed)
    swing = table.swing_nm
    findings = [
        StepFinding(
            "total inertia at the motor shaft",
            f"{assumed:g} kg m² as in the rig file, within {INERTIA[0] - 1:+.0%} to {INERTIA[1] - 1:+.0%}",
            inertia.shown("kg m²"),
            relative.is_within(*INERTIA),
            f"Set [vehicle] inertia_kg_m2 = {inertia.value:.3g}: it tunes the speed holds",
        ),
        StepFinding(
            "dry friction",
            f"at most {FRICTION_SHARE * swing:g} Nm, half of the swing",
            dry.shown("Nm"),
            dry.is_within(-np.inf, FRICTION_SHARE * swing),
            "Look for a brake that drags, or raise swing_nm of the reversal",
        ),
        stated("viscous friction", viscous.shown("Nm s/rad")),
        StepFinding(
            "constant load (grade)",
            f"within ±{LOAD_SHARE * swing:g} Nm, a fifth of the swing",
            load.shown("Nm"),
            load.is_within(-LOAD_SHARE * swing, LOAD_SHARE * swing),
            "Repeat on a level road",
        ),
    ]
    drawn = thinned(record.time_s, record.total_torque_nm, record.output)
    evidence = {
        "inertia_kg_m2": inertia,
        "dry_nm": dry,
        "viscous_nm_s": viscous,
        "load_nm": load,
        "rms_rad_s": fit.rms,
        "course": dict(zip(("time_s", "torque_nm", "speed_rad_s"), drawn, strict=True)),
    }
    return Outcome(findings, evidence)


def _missing() -> StepFinding:
    return StepFinding(
        "reversal",
        "an experiment of kind 'reversal' in the rig file",
        "none",
        None,
        "Add [experiments.reversal]; without it dry friction can't be distinguished from a grade",
    )


FRICTION = Step("friction", "Friction and reversal", _about_friction, _do_friction, _orders_friction, needs=("signs",))
