"""A linear predictor of the output from its own past and the torque's, fitted to one recording: no physics.

What a reading adds to such a prediction is news: it tells when the output answered a torque, or at which instant it
was sampled, before any model of the driveline is believed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.signals.record import BoolArray, FloatArray, Record

ORDER = 12
"""Past samples of output and torque that are seen. A line of two masses needs 2, one of three 4; the rest is there to
average the noise of the reading."""

ROWS_PER_REGRESSOR = 5
"""A recording with fewer usable rows than this per coefficient is not judged."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """A predictor's errors on one recording."""

    rows: np.ndarray[tuple[int], np.dtype[np.intp]]  # (n,): rows that were predicted
    error: FloatArray  # (n,): reading less prediction, in those rows [unit of the output]
    regressors: int  # number of coefficients
    gain: float

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
    if good.size < ROWS_PER_REGRESSOR * 2 * ORDER:
        return None
    y = np.interp(np.arange(n), good, record.output[good] - record.output[good].mean())
    u = record.total_torque_nm
    lags = range(1, ORDER + 1)
    past = [signal[ORDER - lag : n - lag] for signal in (y, u) for lag in lags]
    regressors = np.column_stack([*past, u[ORDER:], np.ones(n - ORDER)])
    usable = trusted[ORDER:] & trusted[ORDER - 1 : -1]
    if usable.sum() < ROWS_PER_REGRESSOR * regressors.shape[1]:
        return None
    seen, measured = regressors[usable], y[ORDER:][usable]
    coefficients = np.linalg.lstsq(seen, measured, rcond=None)[0]
    error = measured - seen @ coefficients
    return Prediction(ORDER + np.flatnonzero(usable), error, seen.shape[1], float(coefficients[ORDER]))


def slope_test(signal: FloatArray, error: FloatArray) -> tuple[float, float]:
    """Return the coefficient of a signal in an error and its standard error, robust to unequal variances.

    White's estimator (Econometrica 48, 1980). The standard error is infinite where the signal is nothing.
    """
    power = float(signal @ signal)
    if power <= 0.0:
        return 0.0, float("inf")
    slope = float(signal @ error) / power
    left = error - slope * signal
    return slope, float(np.sqrt(np.sum((signal * left) ** 2))) / power
