"""Standstill noise: what speed and torque readings show while nothing is asked for."""

from __future__ import annotations

import numpy as np

from hil.commission.finding import Finding
from hil.commission.order import Order
from hil.commission.readings import READING, columns_of, thinned
from hil.commission.step import Job, Outcome, Step
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


def _orders(job: Job) -> list[Order]:
    return [Order("rest", {"kind": "rest", "duration_s": DURATION_S})]


def _about(job: Job) -> str:
    return (
        f"records {DURATION_S:g} s at standstill with the drives armed at zero torque. Nothing is asked for but zero; "
        "the brakes may stay on."
    )


def _do(job: Job) -> Outcome:
    run = job.run("noise", _orders(job)[0])
    columns = columns_of(job.recording(run))
    good = columns[FLAGS] == 0
    speed = columns[SPEED][good]
    mean, std = float(np.mean(speed)), float(np.std(speed))
    findings = [
        Finding(
            "speed noise (RMS)",
            f"at most {SPEED_NOISE_RAD_S:g} rad/s",
            shown(std, "rad/s"),
            std <= SPEED_NOISE_RAD_S,
            "Look at the resolver's cable and shield, and at the drive's speed filter; a larger PRBS makes up for it",
        ),
        Finding(
            "mean speed",
            f"within ±{OFFSET_RAD_S:g} rad/s",
            shown(mean, "rad/s"),
            abs(mean) <= OFFSET_RAD_S,
            "The vehicle rolls, or the speed has an offset: brake it and repeat; then look at the resolver",
        ),
        *(_torque_finding(job, name, columns[READING[name]][good]) for name in READING),
        _lost(run.flagged, run.recorded),
    ]
    evidence = {
        "speed_std_rad_s": std,
        "speed_mean_rad_s": mean,
        "course": dict(zip(("time_s", "speed_rad_s"), thinned(columns[TIME], columns[SPEED]), strict=True)),
    }
    return Outcome(findings, evidence)


def _torque_finding(job: Job, name: str, reading: np.ndarray) -> Finding:
    rated = getattr(job.rig.inverters, name).rated_torque_nm
    mean, std = (1000.0 * float(f(reading)) / rated for f in (np.mean, np.std))
    return Finding(
        f"torque reading of {name}",
        f"mean within ±{TORQUE_PERMILLE:g} ‰ of rated, noise at most {TORQUE_PERMILLE:g} ‰",
        f"mean {mean:z.2f} ‰, noise {std:.2f} ‰",
        abs(mean) <= TORQUE_PERMILLE and std <= TORQUE_PERMILLE,
        f"Calibrate the current sensors of {name}, or look for a torque it gives by itself",
    )


def _lost(flagged: int, recorded: int) -> Finding:
    share = flagged / max(1, recorded)
    return Finding(
        "samples stale or late",
        f"at most {100.0 * LOST_SHARE:g} %",
        f"{100.0 * share:.2f} % of {recorded}",
        share <= LOST_SHARE,
        "Close other programs, look at the bus load and cabling; see docs/benchmarks.md for what a machine can do",
    )


STEP = Step("noise", "Noise at standstill", _about, _do, _orders, needs=("devices",))
