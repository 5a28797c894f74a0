"""Failures in recordings: what can be read and yet not be believed, or not distinguished from."""

import json
import math
import textwrap
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from estimator.signals.record import FloatArray
from tests.cli import bench
from tests.docs.gallery.case import WIDTH, Failure, Outcome, said
from tests.docs.gallery.draw import signals_of
from tests.docs.gallery.recordings import columns_of, cruise, save

RUN, GOOD, MODEL = Path("run_1.csv"), Path("good.csv"), Path("model.toml")
Columns = dict[str, FloatArray]
DIAGNOSE = "hil diagnose run_1.csv --model model.toml --out result"
IDENTIFY = "hil identify run_1.csv --out identified"


def in_rpm(columns: Columns) -> None:
    columns["speed_rad_s"] *= 60.0 / (2.0 * math.pi)


def torque_turned(columns: Columns) -> None:
    for name in ("torque_m1_nm", "torque_m2_nm"):
        columns[name] *= -1.0


def gap(columns: Columns) -> None:
    lost = (columns["time_s"] > 5.0) & (columns["time_s"] < 8.0)
    columns["speed_rad_s"][lost] = np.nan


def speed_clipped(columns: Columns) -> None:
    highest = float(np.quantile(columns["speed_rad_s"], 0.93))
    columns["speed_rad_s"] = np.minimum(columns["speed_rad_s"], highest)


def torque_clipped(columns: Columns) -> None:
    for name in ("torque_m1_nm", "torque_m2_nm"):
        columns[name] = np.minimum(columns[name] + 0.02 * np.sin(40.0 * columns["time_s"]), 6.0)


def diagnosed(change: Callable[[Columns], None], only: tuple[str, ...] = ()) -> Outcome:
    """Spoil a recording of the bench's drive, and diagnose it."""
    bench.record(GOOD, 1, noise=0.02)
    bench.model(MODEL)
    columns = columns_of(GOOD)
    change(columns)
    save(RUN, columns)
    text, status = said(DIAGNOSE, only=only)
    return Outcome(DIAGNOSE, text, status, signals_of(RUN, GOOD))


def cruise_alone() -> Outcome:
    """Diagnose a drive at a speed that never changes its sign."""
    bench.record(RUN, 1, noise=0.02, reverse=False)
    bench.model(MODEL)
    text, status = said(DIAGNOSE, only=("neither found nor excluded", "dry friction at the motor"))
    return Outcome(DIAGNOSE, text, status, signals_of(RUN))


def identified(prbs_nm: float, gain_nm_s: float, finding: str) -> Outcome:
    """Identify a cruise of the bus; show a finding of identification.json too."""
    cruise(RUN, prbs_nm, gain_nm_s)
    text, status = said(IDENTIFY)
    findings = json.loads(Path("identified/identification.json").read_text(encoding="utf-8"))["recordings"][0]
    asked = f"jq -r .recordings[0].{finding}.statement identified/identification.json"
    statement = "\n".join(textwrap.wrap(findings[finding]["statement"], WIDTH))
    return Outcome(IDENTIFY, f"{text}\n$ {asked}\n{statement}", status, signals_of(RUN, until_s=6.0))


def too_short() -> Outcome:
    """Identify a second and a half."""
    cruise(RUN, 120.0, duration_s=1.5)
    return Outcome(IDENTIFY, *said(IDENTIFY))


RECORDINGS = (
    Failure("wrong_units", partial(diagnosed, in_rpm), quick=True),
    Failure("wrong_sign", partial(diagnosed, torque_turned), quick=True),
    Failure("gap", partial(diagnosed, gap, ("Note:",))),
    Failure("clipped_speed", partial(diagnosed, speed_clipped, ("Note:",))),
    Failure("clipped_torque", partial(diagnosed, torque_clipped, ("found", "nonlinear torque", "Note:"))),
    Failure("cruise_alone", cruise_alone),
    Failure("weak_prbs", partial(identified, 1.0, 0.0, "validation")),
    Failure("closed_loop", partial(identified, 20.0, 60.0, "feedback")),
    Failure("too_short", too_short, quick=True),
)
