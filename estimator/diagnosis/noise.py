"""Noise of a reading, from the data alone: no model and no law is in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimator.diagnosis.thresholds import Noise
from estimator.errors import NotExciting
from estimator.signals.record import BoolArray, FloatArray, Record


def noise_floor(records: Sequence[Record]) -> float:
    """Estimate the noise of the reading, from the data alone."""
    squares, count = 0.0, 0
    pairs = [(record, _usable(record)) for record in records]
    long = [(record, usable) for record, usable in pairs if usable.sum() >= Noise.FEWEST_PREDICTED]
    if not long:
        record, usable = max(pairs, key=lambda pair: int(pair[1].sum()))
        raise NotExciting(
            f"recording {record.name}: {usable.sum()} samples follow {Noise.PREDICTOR_ORDER} samples of which most are "
            f"good, expected at least {Noise.FEWEST_PREDICTED} to estimate the noise. Too many are masked: check flags "
            "and mask."
        )
    for record, usable in long:
        errors = _one_step_errors(record, usable)
        squares += float(errors @ errors)
        count += max(errors.size - 2 * Noise.PREDICTOR_ORDER - 1, 1)
    return float(np.sqrt(squares / count))


def _usable(record: Record) -> BoolArray:
    """Return which samples a predictor can be asked for, from the first with a whole past on."""
    if record.okay.size <= Noise.PREDICTOR_ORDER:
        return np.zeros(0, dtype=np.bool_)
    seen = np.lib.stride_tricks.sliding_window_view(record.okay, Noise.PREDICTOR_ORDER + 1).mean(axis=1)
    return record.okay[Noise.PREDICTOR_ORDER :] & (seen >= Noise.MOSTLY_GOOD)


def _one_step_errors(record: Record, usable: BoolArray) -> FloatArray:
    good = np.flatnonzero(record.okay)
    y = np.interp(np.arange(record.okay.size), good, record.output[good] - record.output[good].mean())
    u = record.total_torque_nm
    n = Noise.PREDICTOR_ORDER
    lags = range(1, n + 1)
    columns = [signal[n - lag : signal.size - lag] for signal in (y, u) for lag in lags]
    regressors = np.column_stack([*columns, np.ones(y.size - n)])
    a, b = regressors[usable], y[n:][usable]
    return b - a @ np.linalg.lstsq(a, b, rcond=None)[0]
