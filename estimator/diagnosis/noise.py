"""How much of an error is noise: the floor no model gets below."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.errors import NotExciting
from estimator.signals.record import BoolArray, FloatArray, Record

PREDICTOR_ORDER = 20
"""Past samples a one-step predictor sees: 0.2 s at 10 ms, more than a period of a driveline's first mode."""

MOSTLY_GOOD = 0.75
"""Share of good samples that a predictor's past must hold; the missing ones are interpolated."""

FEWEST_PREDICTED = 2 * (2 * PREDICTOR_ORDER + 1)
"""Samples that a predictor is fitted to at least: two per coefficient."""


def noise_floor(records: Sequence[Record]) -> float:
    """Estimate the noise of the reading, from the data alone.

    The floor is the RMS error of a linear one-step predictor that sees the last outputs and torques. A predictor
    follows whatever moves slowly, missing physics included, so what it leaves is the noise of the sensor [unit of
    the output]. Recordings, or segments, too short for a predictor of their own are left to the others.

    Raises
    ------
    NotExciting
        If so many samples are masked that no predictor can be fitted to any recording.
    """
    squares, count = 0.0, 0
    pairs = [(record, _usable(record)) for record in records]
    long = [(record, usable) for record, usable in pairs if usable.sum() >= FEWEST_PREDICTED]
    if not long:
        record, usable = max(pairs, key=lambda pair: int(pair[1].sum()))
        raise NotExciting(
            f"recording {record.name}: {usable.sum()} samples follow {PREDICTOR_ORDER} samples of which most are good, "
            f"expected at least {FEWEST_PREDICTED} to estimate the noise. Too many are masked: check flags and mask."
        )
    for record, usable in long:
        errors = _one_step_errors(record, usable)
        squares += float(errors @ errors)
        count += max(errors.size - 2 * PREDICTOR_ORDER - 1, 1)
    return float(np.sqrt(squares / count))


def _usable(record: Record) -> BoolArray:
    """Return which samples a predictor can be asked for, from the first with a whole past on."""
    if record.okay.size <= PREDICTOR_ORDER:
        return np.zeros(0, dtype=np.bool_)
    seen = np.lib.stride_tricks.sliding_window_view(record.okay, PREDICTOR_ORDER + 1).mean(axis=1)
    usable: BoolArray = record.okay[PREDICTOR_ORDER:] & (seen >= MOSTLY_GOOD)
    return usable


def _one_step_errors(record: Record, usable: BoolArray) -> FloatArray:
    good = np.flatnonzero(record.okay)
    y = np.interp(np.arange(record.okay.size), good, record.output[good] - record.output[good].mean())
    u = record.total_torque_nm
    n = PREDICTOR_ORDER
    lags = range(1, n + 1)
    columns = [signal[n - lag : signal.size - lag] for signal in (y, u) for lag in lags]
    regressors = np.column_stack([*columns, np.ones(y.size - n)])
    a, b = regressors[usable], y[n:][usable]
    errors: FloatArray = b - a @ np.linalg.lstsq(a, b, rcond=None)[0]
    return errors


def unpredictable(errors: Sequence[FloatArray]) -> float:
    """Return the RMS of what a set of simulation errors' own past does not predict.

    A second, often sharper view of the floor: once a model explains most of what happens, what its error leaves to a
    linear predictor of itself is the noise of the reading.
    """
    n = PREDICTOR_ORDER
    past = np.concatenate([np.lib.stride_tricks.sliding_window_view(error[:-1], n) for error in errors])
    now = np.concatenate([error[n:] for error in errors])
    left = now - past @ np.linalg.lstsq(past, now, rcond=None)[0]
    return float(np.sqrt(left @ left / max(left.size - n, 1)))
