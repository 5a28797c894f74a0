"""Sample jitter that the time stamps tell of: rows whose instants are off the uniform time base.

Stamps of a host may be irregular while the readings were taken on time. So the output is asked: where it moves, a
reading taken late shows what the output was later. Stamps are believed when it agrees.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from estimator.diagnosis.acquisition.finding import LEVEL, OUTPUT, SMALLEST_P, Finding, Sized, no_cells
from estimator.diagnosis.acquisition.predictor import predict, slope_test
from estimator.diagnosis.acquisition.quantised import decimal_place
from estimator.signals.record import FloatArray, Record, uniform_period_s

AGREEMENT = 0.5
"""Share of the stamps' offsets that the output must confirm: half way between none and all."""

ABOVE_ROUNDING = 2.0
"""Offsets of this many times what rounding the stamps leaves are more than rounding."""

SMALLEST_PERIODS = 1e-3
"""Jitter below this share of the period is not looked into."""


def stamp_offsets_s(record: Record) -> FloatArray:
    """Return how far each time stamp is from the uniform time base [s]; zeros where stamps are even, shape (N,).

    Even means to within their own resolution and a clock's: the uniform time base is taken off, and what is left counts
    if it is well above what rounding the stamps leaves.
    """
    since = record.time_s - uniform_period_s(record.time_s) * np.arange(record.time_s.size)
    offset: FloatArray = since - since.mean()
    rounding_s = decimal_place(record.time_s) / np.sqrt(12.0)
    smallest = max(ABOVE_ROUNDING * rounding_s, SMALLEST_PERIODS * record.sample_time_s)
    return offset if float(np.std(offset)) > smallest else np.zeros_like(offset)


def stamped_jitter(records: Sequence[Record]) -> Finding | None:
    """Recognise jitter that stamps tell and the output confirms; None otherwise."""
    offsets = {record.name: stamp_offsets_s(record) for record in records}
    stamped = [record for record in records if offsets[record.name].any()]
    confirmed = [found for record in stamped if (found := _confirmed(record, offsets[record.name])) is not None]
    if not confirmed:
        return None
    agreement, error = _pooled(confirmed)
    p_value = float(stats.norm.sf(agreement / error))
    if p_value > LEVEL or agreement < AGREEMENT:
        return None
    every = np.concatenate([offsets[record.name] for record in stamped])
    jitter_s, n = float(np.std(every)), every.size
    low, high = (jitter_s * float(np.sqrt(n / stats.chi2.ppf(q, n))) for q in (0.975, 0.025))
    cells = {record.name: no_cells(record) for record in records}
    for record in stamped:
        cells[record.name][:, OUTPUT] = True
    return Finding(
        name="sample_jitter",
        parameters={"jitter_s": Sized(jitter_s, (low, high), "s")},
        cells=cells,
        p_value=max(p_value, SMALLEST_P),
        statement=f"the samples were taken {1e3 * jitter_s:.2g} ms (rms) off their time, as their time stamps show",
    )


def _confirmed(record: Record, offset_s: FloatArray) -> tuple[float, float] | None:
    """Return which share of the offsets the output confirms, and its standard error; None where it can't tell."""
    trusted = record.okay & np.isfinite(record.output)
    trusted[[0, -1]] = False
    trusted[1:-1] &= np.isfinite(record.output[2:]) & np.isfinite(record.output[:-2])
    prediction = predict(record, trusted)
    if prediction is None:
        return None
    slope = np.gradient(np.where(np.isfinite(record.output), record.output, 0.0), record.sample_time_s)
    agreement, error = slope_test((slope * offset_s)[prediction.rows], prediction.error)
    return (agreement, error) if np.isfinite(error) and error > 0.0 else None


def _pooled(found: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the mean of estimates, weighed by their precision, and its standard error."""
    weights = np.array([1.0 / error**2 for _, error in found])
    mean = float(weights @ np.array([value for value, _ in found])) / float(weights.sum())
    return mean, float(1.0 / np.sqrt(weights.sum()))
