"""A line that answers to a torque much as a plant does that another program simulates.

It takes no part in what is simulated. By it are judged: how a disturbance of the torque shows in the output, the time
scale on which that moves, and in which unit the torque is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from estimator.physics.fit import FitResult, fit, make_problem
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.motion import measured_speed
from estimator.physics.unknowns import Shared
from estimator.signals.record import Record

WIDE = 30.0
"""Factor, either way, within which values are looked for."""

SHARES = (0.05, 0.3)
"""Share of the motor in the whole inertia, where a fit starts."""

FREQUENCIES = 5
"""Natural frequencies at which one starts, up to `HIGHEST_HZ` or a quarter of the sampling rate."""

LOWEST_HZ, HIGHEST_HZ = 1.0, 60.0
DAMPING = 0.05

BETTER = 0.7
"""Share of a rigid line's error that one with a shaft leaves at most to be taken."""

ITERATIONS = 12
"""Of the fit from each start; the best goes to its end."""


def equivalent_line(records: Sequence[Record]) -> DrivelineModel:
    """Return a line with one inertia or two, trusted exactly, that answers as the outputs of some recordings."""
    inertia, viscous = _rigid(records)
    one = _fitted(Structure.ONE_MASS, {"J_M": inertia, "b_M": viscous}, records)
    highest = min(HIGHEST_HZ, 0.25 / records[0].sample_time_s)
    starts = [
        _two_masses(inertia, viscous, share, hz)
        for share in SHARES
        for hz in np.geomspace(LOWEST_HZ, highest, FREQUENCIES).tolist()
    ]
    near = min((_fitted(Structure.TWO_MASS, start, records) for start in starts), key=lambda result: result.rms)
    two = fit(near.problem, near.x)
    structure, best = (Structure.TWO_MASS, two) if two.rms < BETTER * one.rms else (Structure.ONE_MASS, one)
    values = best.values_of("")
    return DrivelineModel(structure, {name: Parameter(values[name], 0.0) for name in structure.parameter_names})


def _rigid(records: Sequence[Record]) -> tuple[float, float]:
    """Return inertia and viscous friction of a rigid line, by regression on ``J (w - w_0) = S T - b S w - T_0 t``."""
    columns, moved = [], []
    for record in records:
        whole, period_s = measured_speed(record), record.sample_time_s
        known = np.isfinite(whole)  # the slope of an angle is not, at its ends
        speed, time_s = whole[known], record.time_s[known]
        turned, driven = (np.cumsum(each) * period_s for each in (speed, record.total_torque_nm[known]))
        columns.append(np.column_stack([driven, -turned, time_s[0] - time_s])[:-1])
        moved.append(speed[1:] - speed[0])
    found = np.linalg.lstsq(np.concatenate(columns), np.concatenate(moved), rcond=None)[0]
    inertia = 1.0 / max(abs(float(found[0])), np.finfo(float).tiny)
    return inertia, max(float(found[1]) * inertia, 1e-3 * inertia)


def _two_masses(inertia: float, viscous: float, share: float, hz: float) -> dict[str, float]:
    motor, load = share * inertia, (1.0 - share) * inertia
    reduced, turn = motor * load / inertia, 2.0 * math.pi * hz
    half = 0.5 * viscous
    return {
        "J_M": motor,
        "J_L": load,
        "k": reduced * turn**2,
        "c": 2.0 * DAMPING * reduced * turn,
        "b_M": half,
        "b_L": half,
    }


def _fitted(structure: Structure, start: Mapping[str, float], records: Sequence[Record]) -> FitResult:
    model = DrivelineModel(structure, {name: Parameter(start[name], 0.0) for name in structure.parameter_names})
    shared = [Shared("", name, start[name], 1.0 / WIDE, WIDE, 1.0) for name in structure.parameter_names]
    return fit(make_problem(model, records, shared), iterations=ITERATIONS)
