"""Findings: what was recognised in the raw recordings, its size, and the readings it touches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import stats

from estimator.diagnosis.thresholds import Findings
from estimator.signals.record import BoolArray, FloatArray, Record

OUTPUT = 0  # column of the measured output in ``Finding.cells``; torque input i is column ``1 + i``


def channels(record: Record) -> FloatArray:
    """Return output and torques side by side, NaN where nothing was read; shape (N, 1 + M)."""
    torque = np.where(record.torque_trusted, record.torque_nm, np.nan)
    return np.column_stack([record.output, torque])


def runs(rows: BoolArray) -> list[tuple[int, int]]:
    """Return where True begins and ends, ``[begin, end)`` of each stretch; of a mask of shape (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def share_interval(count: float, total: float, mean_run: float = 1.0) -> tuple[float, float]:
    """Return the exact 95 % interval of a share (Clopper and Pearson, Biometrika 26, 1934)."""
    events, trials = count / mean_run, total / mean_run
    low = 0.0 if events <= 0 else float(stats.beta.ppf(0.025, events, trials - events + 1.0))
    high = 1.0 if events >= trials else float(stats.beta.ppf(0.975, events + 1.0, trials - events))
    return low, high


def mean_run(masks: list[BoolArray]) -> float:
    """Return how many rows of a clustered mask count as one: sum of squared run lengths over their sum, at least 1."""
    lengths = np.array([end - begin for mask in masks for begin, end in runs(mask)], dtype=np.float64)
    return float(lengths @ lengths / lengths.sum()) if lengths.size else 1.0


class Sized(NamedTuple):
    """A parameter as found: value, 95 % interval, unit."""

    value: float  # estimate [unit]
    ci95: tuple[float, float]  # [unit]
    unit: str  # "" where it has none


@dataclass(frozen=True, slots=True)
class AcquisitionFinding:
    """One effect of the acquisition or of the sensor's resolution."""

    name: str  # as in the catalogue
    parameters: Mapping[str, Sized]  # by name, as the catalogue has them
    cells: Mapping[str, BoolArray]  # (N, 1 + M): the readings it touches
    p_value: float  # probability of as much by chance in recordings without the effect
    statement: str  # one sentence for an engineer

    def touched(self, record: Record) -> BoolArray:
        """Return the readings of a recording that are touched, shape (N, 1 + M); none where it has not been seen."""
        cells = self.cells.get(record.name)
        return no_cells(record) if cells is None else cells

    def rows(self, record: Record) -> BoolArray:
        """Return the rows of a recording in which a reading is touched, shape (N,)."""
        return np.any(self.touched(record), axis=1)


def no_cells(record: Record) -> BoolArray:
    """Return a mask of a recording's readings that is False throughout, shape (N, 1 + M)."""
    n, inputs = record.torque_nm.shape
    return np.zeros((n, 1 + inputs), dtype=np.bool_)


@dataclass(frozen=True, slots=True)
class Prediction:
    """A predictor's errors on one recording."""

    rows: np.ndarray[tuple[int], np.dtype[np.intp]]  # (n,): rows that were predicted
    error: FloatArray  # (n,): reading less prediction, in those rows [unit of the output]
    regressors: int  # number of coefficients
    gain: float  # change of the output per change of the torque, summed over its lags [unit of the output/Nm]

    @property
    def typical(self) -> float:
        """Typical error, as the standard deviation of a Gaussian with the same median; blind to a few wild rows."""
        return 1.4826 * float(np.median(np.abs(self.error)))

    @property
    def sigma(self) -> float:
        """RMS error, degrees of freedom taken into account."""
        return float(np.sqrt(self.error @ self.error / (self.error.size - self.regressors)))


def predict(record: Record, trusted: BoolArray) -> Prediction | None:
    """Fit the predictor to a recording.

    The torque of the row itself is among the regressors. By the convention of every recording it acts later, so its
    coefficient is zero; where the torque is recorded a row late it takes up what would pass for staleness.
    """
    good = np.flatnonzero(trusted)
    n = trusted.size
    if good.size < Findings.ROWS_PER_REGRESSOR * 2 * Findings.ORDER:
        return None
    y = np.interp(np.arange(n), good, record.output[good] - record.output[good].mean())
    u = record.total_torque_nm
    lags = range(1, Findings.ORDER + 1)
    past = [signal[Findings.ORDER - lag : n - lag] for signal in (y, u) for lag in lags]
    regressors = np.column_stack([*past, u[Findings.ORDER :], np.ones(n - Findings.ORDER)])
    usable = trusted[Findings.ORDER :] & trusted[Findings.ORDER - 1 : -1]
    if usable.sum() < Findings.ROWS_PER_REGRESSOR * regressors.shape[1]:
        return None
    seen, measured = regressors[usable], y[Findings.ORDER :][usable]
    coefficients = np.linalg.lstsq(seen, measured, rcond=None)[0]
    error = measured - seen @ coefficients
    return Prediction(
        Findings.ORDER + np.flatnonzero(usable), error, seen.shape[1], float(coefficients[Findings.ORDER])
    )
