"""Positions that wrap: a counter or an angle that begins anew after a turn, which no motion does.

From one sample to the next the reading jumps by more than half of its whole range, always as far, and continues from
there as before. It is put together again; where jumps are of different sizes they are something else and stay.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.signals.record import BoolArray, FloatArray, OutputKind, Record

HALF = 0.5
"""Share of the range of a reading that a jump must exceed."""

FAR = 4.0
"""How far a jump must be, in the largest other steps."""

TURN = 2.0 * math.pi
NEAR_A_TURN = 0.01
"""Share within which a jump is one of a whole turn."""


def period_of(values: FloatArray, seen: BoolArray) -> float | None:
    """Return after how much a reading begins anew; None where it does not.

    Parameters
    ----------
    values : ndarray, shape (N,)
    seen : ndarray of bool, shape (N,)
        Which rows were read.

    Returns
    -------
    float or None
        In the unit of the reading; a single jump counts only if it is of a whole turn [rad].
    """
    both = seen[1:] & seen[:-1] & (values[1:] != 0.0) & (values[:-1] != 0.0)  # a lost reading is zero
    steps = np.where(both, np.diff(values), 0.0)
    jumps = np.abs(steps) > HALF * float(np.ptp(values[seen]))
    if not jumps.any() or jumps.all():
        return None
    largest = float(np.abs(steps[~jumps]).max())
    sizes = np.abs(steps[jumps])
    if sizes.min() <= FAR * largest or float(np.ptp(sizes)) > 2.0 * largest:
        return None
    onward = np.array([_motion(steps, jumps, i) for i in np.flatnonzero(jumps).tolist()])
    period = float(np.mean(np.sign(steps[jumps]) * (steps[jumps] - onward)))
    if abs(period / TURN - 1.0) <= NEAR_A_TURN:
        return TURN
    return period if sizes.size > 1 else None


def _motion(steps: FloatArray, jumps: BoolArray, at: int) -> float:
    """Return the step that the motion itself makes at a jump: the mean of those around it."""
    around = [i for i in (at - 1, at + 1) if 0 <= i < steps.size and not jumps[i]]
    return float(np.mean(steps[around])) if around else 0.0


def unwrapped(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Put wrapped positions together again; say so."""
    mended, warnings = [], []
    for record in records:
        seen = record.okay & np.isfinite(record.output)
        period = period_of(record.output, seen) if record.kind is OutputKind.POSITION and seen.any() else None
        if period is None:
            mended.append(record)
            continue
        output = record.output.copy()
        output[seen] = np.unwrap(output[seen], period=period)
        mended.append(replace(record, output=output))
        warnings.append(
            f"recording {record.name}: the position wraps after {period:.6g} and was unwrapped. If it is no wrapped "
            "angle, give it as it was read, without jumps."
        )
    return mended, warnings
