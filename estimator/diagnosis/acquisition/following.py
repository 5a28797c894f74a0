"""What a torque was in rows where it was not read, from the reference that it follows.

Whoever commands a torque knows the reference in every row, those included in which the answer was lost. How a drive
follows it, a share of it over a few periods, shows in the rows that were read; what is left over, an offset that
drifts, is carried across by a straight line.
"""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.acquisition.readings import all_of
from estimator.signals.record import BoolArray, FloatArray

PERIODS = 3
"""The torque of a row is predicted from its own reference and from those before it, so many in all."""

FEWEST_ROWS = 100
"""Fewer rows that were read do not show how a drive follows."""

MOST_LEFT = 0.25
"""Share of the torque's changes, as a power, that a reference may leave; one that leaves more does not tell."""

AS_GOOD = 0.003
"""One that leaves no more than this share tells the torque as well as a reading does: of a step a twentieth is left."""


def followed(torque: FloatArray, trusted: BoolArray, reference: FloatArray) -> tuple[FloatArray, BoolArray, bool]:
    """Return a torque as its reference tells it.

    Parameters
    ----------
    torque, trusted : ndarray, shape (N,)
        Readings [Nm], and where they are to be trusted.
    reference : ndarray, shape (N,)
        What was asked of all drives together, or of this one [Nm]; NaN where it is not known.

    Returns
    -------
    ndarray, shape (N,)
        Torque by the reference [Nm].
    ndarray of bool, shape (N,)
        Where the reference tells it; nowhere if the torque does not follow.
    bool
        Whether that is as good as a reading.
    """
    regressors = _regressors(np.where(~trusted & (reference == 0.0), np.nan, reference))  # lost with the torque
    predicted = all_of(np.isfinite(regressors))
    read = predicted & trusted
    both = read[1:] & read[:-1]
    if read.sum() < FEWEST_ROWS or not both.any():
        return torque, np.zeros_like(trusted), False
    gain = np.linalg.lstsq(regressors[read], torque[read])[0]
    by_reference = regressors @ gain
    rows = np.flatnonzero(read)
    by_reference += np.interp(np.arange(torque.size), rows, (torque - by_reference)[rows])
    left, change = np.diff(torque - regressors @ gain)[both], np.diff(torque)[both]
    power_left, power = float(left @ left), float(change @ change)
    if power_left > MOST_LEFT * power:
        return torque, np.zeros_like(trusted), False
    return by_reference, predicted, power_left <= AS_GOOD * power


def _regressors(reference: FloatArray) -> FloatArray:
    """Return the references of each row and of those before it, and one for an offset; shape (N, PERIODS + 1)."""
    before = [np.concatenate([np.full(lag, reference[0]), reference[: reference.size - lag]]) for lag in range(PERIODS)]
    return np.column_stack([*before, np.ones(reference.size)])
