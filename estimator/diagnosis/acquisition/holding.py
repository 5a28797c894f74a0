"""What a torque was in rows where it was not read: by its reference or its clock, else by a straight line.

A pseudo-random torque changes only at the ticks of its clock, every h samples, and always by the same step. Between the
last good reading and the next one there are none, one or more ticks. None: the torque stayed. One: it changed at that
tick and no other. With two ticks or more, or a change of another size (the base torque stepped too), it is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.acquisition.following import followed
from estimator.diagnosis.acquisition.readings import runs
from estimator.signals.record import BoolArray, FloatArray

LONGEST_HOLD = 20
"""Longest clock looked for, in samples."""

ON_TICK = 0.95
"""Share of the steps that must fall on the ticks; the rest may be steps of the base torque."""

FEWEST_STEPS = 20
"""Fewer steps do not show a clock."""

CLEAR_STEP = 8.0
"""A step is a change this many times the usual one within a hold."""

SAME_STEP = 0.2
"""A change is the clock's step if it differs from it by at most this share: the base torque may drift meanwhile."""


@dataclass(frozen=True, slots=True)
class Clock:
    """When and by how much a torque steps: in rows ``k % period == phase`` [samples], by ``+-step_nm``."""

    period: int
    phase: int
    step_nm: float
    usual_nm: float

    def ticks(self, first: int, last: int) -> list[int]:
        """Return the ticks from one row to another, both included."""
        return [row for row in range(first, last + 1) if row % self.period == self.phase]

    def explains(self, change_nm: float) -> bool:
        """Tell whether a change is one step of the clock, or none."""
        size = abs(change_nm)
        return size <= CLEAR_STEP * self.usual_nm or abs(size - self.step_nm) <= SAME_STEP * self.step_nm


def clock_of(torque: FloatArray, trusted: BoolArray) -> Clock | None:
    """Return the clock at whose ticks a torque steps; None where there is none of two samples or more.

    Parameters
    ----------
    torque, trusted : ndarray, shape (N,)
        Readings [Nm], and where they are to be trusted.
    """
    change = np.abs(np.diff(torque))
    known = trusted[1:] & trusted[:-1]
    if known.sum() < FEWEST_STEPS:
        return None
    usual = 1.4826 * float(np.median(change[known]))
    steps = 1 + np.flatnonzero(known & (change > CLEAR_STEP * usual))
    if steps.size < FEWEST_STEPS:
        return None
    for period in range(LONGEST_HOLD, 1, -1):
        on_tick = np.bincount(steps % period, minlength=period)
        if on_tick.max() >= ON_TICK * steps.size:
            return Clock(period, int(on_tick.argmax()), float(np.median(change[steps - 1])), usual)
    return None


def fill(torque: FloatArray, trusted: BoolArray, reference: FloatArray | None = None) -> tuple[FloatArray, BoolArray]:
    """Return a torque with what is not trusted replaced, and where the replacement is as good as a reading.

    Parameters
    ----------
    torque, trusted : ndarray, shape (N,)
        Readings [Nm], and where they are to be trusted.
    reference : ndarray, shape (N,), optional
        What the torque follows [Nm], NaN where not known.

    Returns
    -------
    ndarray, shape (N,)
        Filled torque [Nm].
    ndarray of bool, shape (N,)
        True where read, or known by reference or clock.
    """
    filled, known = _by_clock(torque, trusted)
    if reference is None or trusted.all():
        return filled, known
    by_reference, predicted, as_good = followed(torque, trusted, reference)
    unread = predicted & ~trusted & (as_good | ~known)
    filled[unread] = by_reference[unread]
    return filled, known | (unread & as_good)


def _by_clock(torque: FloatArray, trusted: BoolArray) -> tuple[FloatArray, BoolArray]:
    clock = clock_of(torque, trusted)
    filled, known = torque.copy(), trusted.copy()
    for begin, end in runs(~trusted):
        before, after = torque[max(begin - 1, 0)], torque[min(end, torque.size - 1)]
        if begin == 0 or end == torque.size:
            filled[begin:end] = after if end < torque.size else before
            continue
        filled[begin:end] = np.linspace(before, after, end - begin + 2)[1:-1]
        if clock is not None and clock.explains(after - before) and len(ticks := clock.ticks(begin, end)) < 2:
            change = ticks[0] if ticks else end
            filled[begin:change], filled[change:end] = before, after
            known[begin:end] = True
    return filled, known
