"""The readings of a recording, channel by channel, and the runs of rows in which something holds."""

from __future__ import annotations

import numpy as np
from scipy import stats

from estimator.signals.record import BoolArray, FloatArray, Record


def channels(record: Record) -> FloatArray:
    """Return output and torques side by side, NaN where nothing was read; shape (N, 1 + M)."""
    torque = np.where(record.torque_trusted, record.torque_nm, np.nan)
    return np.column_stack([record.output, torque])


def flagged(record: Record) -> BoolArray:
    """Return the rows in which the output was not read, or no torque was (a flagged row); shape (N,)."""
    missing: BoolArray = ~np.isfinite(record.output) | ~record.torque_trusted.any(axis=1)
    return missing


def any_of(cells: BoolArray) -> BoolArray:
    """Return the rows with at least one True, shape (N,)."""
    rows: BoolArray = np.logical_or.reduce(cells, axis=1)
    return rows


def all_of(cells: BoolArray) -> BoolArray:
    """Return the rows that are True throughout, shape (N,)."""
    rows: BoolArray = np.logical_and.reduce(cells, axis=1)
    return rows


def runs(rows: BoolArray) -> list[tuple[int, int]]:
    """Return where each run of True begins and the row after its end."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def shorter_runs(rows: BoolArray, longest: int) -> BoolArray:
    """Return the rows that are in a run of at most ``longest``; shape (N,)."""
    kept = rows.copy()
    for begin, end in runs(rows):
        if end - begin > longest:
            kept[begin:end] = False
    return kept


def share_interval(count: float, total: float, mean_run: float = 1.0) -> tuple[float, float]:
    """Return the exact 95 % interval of a share (Clopper and Pearson, Biometrika 26, 1934).

    What comes in runs counts as one piece of evidence a run.
    """
    events, trials = count / mean_run, total / mean_run
    low = 0.0 if events <= 0 else float(stats.beta.ppf(0.025, events, trials - events + 1.0))
    high = 1.0 if events >= trials else float(stats.beta.ppf(0.975, events + 1.0, trials - events))
    return low, high


def mean_run(masks: list[BoolArray]) -> float:
    """Return how many rows of a clustered mask count as one: sum of squared run lengths over their sum, at least 1."""
    lengths = np.array([end - begin for mask in masks for begin, end in runs(mask)], dtype=np.float64)
    return float(lengths @ lengths / lengths.sum()) if lengths.size else 1.0
