"""Stale torques, shown by the output: it answers a torque step a row before the torque is recorded to step.

A torque that is held for some samples repeats by right, so its repeats alone say little. But where a repeat is
followed by a step and the output has already answered that step, the repeated reading was stale. The test compares
the rows before steps that repeat with those that do not: a torque that is recorded late throughout (a delay, clocks
that drift apart), or an output that a linear predictor can't follow, shows in both and is no staleness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from estimator.diagnosis.acquisition.lattice import lattice_step, repeats
from estimator.diagnosis.acquisition.predictor import predict
from estimator.diagnosis.acquisition.readings import all_of
from estimator.signals.record import BoolArray, FloatArray, Record

CLEAR = (2.0, 3.0, 4.0)
"""A step tells whether it was answered where the answer is this many times the predictor's error. Torques found stale
are mended and the predictor fitted again, for wrong torques blur it; each pass asks for more, the last one counts."""

ANSWERED = 0.5
"""Share of the answer that must have come early: half way between none and all of it."""


@dataclass(frozen=True, slots=True)
class LateTorque:
    """What one recording says of some torque inputs together.

    Attributes
    ----------
    rows : ndarray of bool, shape (N,)
        Rows whose torques repeat while the output answers the next one.
    early, repeats : int
        Clear steps that were answered early, of those before which the torque repeats.
    early_others, others : int
        The same of those before which it does not.
    """

    rows: BoolArray
    early: int
    repeats: int
    early_others: int
    others: int


def late_torque(record: Record, inputs: Sequence[int], trusted: BoolArray) -> LateTorque | None:
    """Examine torque inputs that may be stale in the same rows; None where no predictor can be fitted.

    Parameters
    ----------
    inputs : sequence of int
        Which; a row repeats where all of them do.
    trusted : ndarray of bool, shape (N,)
        Rows whose output may be used.
    """
    torque = record.torque_nm[:, inputs].sum(axis=1)
    read = all_of(record.torque_trusted[:, inputs])
    again = read & all_of(np.column_stack([_repeats(record.torque_nm[:, i]) for i in inputs]))
    step = np.append(np.where(read[1:], np.diff(torque), 0.0), 0.0)  # from this row to the next
    found, stale = None, np.zeros_like(read)
    for clear in CLEAR:
        prediction = predict(_mended(record, inputs, stale), trusted)
        if prediction is None or prediction.gain == 0.0:
            return None
        early = np.full(torque.size, np.nan)  # torque beyond the recorded that the next output speaks of
        early[prediction.rows - 1] = prediction.error / prediction.gain
        early += _next_fresh(torque, stale) - torque  # which the predictor was given already
        found = _late(again, step, early, np.abs(step * prediction.gain) > clear * prediction.typical)
        stale = found.rows
    return found


def _repeats(torque: FloatArray) -> BoolArray:
    return repeats(torque, lattice_step(torque))


def _late(again: BoolArray, step: FloatArray, early: FloatArray, clear: BoolArray) -> LateTorque:
    """Compare the clear steps after repeats with the others, and follow a burst of repeats back to its beginning."""
    clear = clear & np.isfinite(early)
    answered = np.zeros_like(clear)
    answered[clear] = early[clear] / step[clear] > ANSWERED
    rows = np.zeros_like(clear)
    for last in np.flatnonzero(answered & again):
        row = int(last)
        while row > 0 and again[row] and early[row] / step[last] > ANSWERED:
            rows[row] = True
            row -= 1
    counts = (answered & again, clear & again, answered & ~again, clear & ~again)
    return LateTorque(rows, *(int(count.sum()) for count in counts))


def _next_fresh(torque: FloatArray, stale: BoolArray) -> FloatArray:
    """Return in each row the torque of the next row that is not stale, shape (N,)."""
    rows = np.where(stale, torque.size - 1, np.arange(torque.size))
    following: FloatArray = torque[np.minimum.accumulate(rows[::-1])[::-1]]
    return following


def _mended(record: Record, inputs: Sequence[int], stale: BoolArray) -> Record:
    torque = record.torque_nm.copy()
    for i in inputs:
        torque[:, i] = _next_fresh(torque[:, i], stale)
    return replace(record, torque_nm=torque)


def pooled_p_value(found: Sequence[LateTorque]) -> float:
    """Return the probability of so many early answers after repeats, if they were as common as elsewhere.

    Elsewhere in the same recording: where the predictor follows one worse than the others, that one has more of both.
    Above its mean a sum of binomials is at most as far out as Poisson's law of that mean (Hoeffding, Ann. Math. Stat.
    27, 1956); that probability is returned.
    """
    usual = sum(late.repeats * (late.early_others + 1.0) / (late.others + 2.0) for late in found)
    return float(stats.poisson.sf(sum(late.early for late in found) - 1, usual))
