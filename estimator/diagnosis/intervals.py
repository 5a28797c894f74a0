"""Intervals of fitted parameters that hold although the errors are correlated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from estimator.diagnosis.noise import residuals_by_record, unpredictable
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import STEP
from estimator.physics.model import parameter_dimension
from estimator.physics.unknowns import Shared
from estimator.signals.correlation import correlation_length
from estimator.signals.record import BoolArray, FloatArray

Z95 = 1.959963984540054
"""97.5 % point of the normal distribution."""

COHERENT_S = 1.0
"""How long an error that is no noise keeps its value: the pace at which a test changes what it excites."""


def covariance(result: FitResult) -> FloatArray:
    """Return the covariance of the scaled unknowns, shape (U, U), by the sandwich formula.

    ``C = B M B`` with ``B = (J'J)^-1`` and ``M`` the long-run covariance of the scores ``J_k e_k``, Bartlett
    weights over several correlation lengths of the error (Newey and West, Econometrica 55, 1987). An effect's
    parameter at a bound of its law is held there and has no variance. A nominal parameter at the edge of its tolerance
    is not: the tolerance is a belief about it, and how well the data determine it does not change there.
    """
    free = _free(result)
    j = result.jacobian[:, free]
    bread = _bread(j)
    full = np.zeros((result.x.size, result.x.size))
    full[np.ix_(free, free)] = bread @ _meat(result, j) @ bread
    return full


def reported_covariance(result: FitResult) -> FloatArray:
    """Return the covariance that intervals are reported from, shape (U, U): of the noise, and of what is no noise."""
    free = _free(result)
    full = covariance(result)
    full[np.ix_(free, free)] += coherent_variance(result) * _bread(result.jacobian[:, free])
    return full


def coherent_variance(result: FitResult) -> float:
    """Return the mean square of the error that is no noise, times the samples for which it keeps its value."""
    coherent = max(result.rms**2 - unpredictable(residuals_by_record(result)) ** 2, 0.0)
    return coherent * COHERENT_S / min(record.sample_time_s for record in result.problem.records)


def _free(result: FitResult) -> BoolArray:
    held = result.pinned
    of_effects = np.array([bool(shared.effect) for shared in result.problem.shared], dtype=np.bool_)
    held[: of_effects.size] &= of_effects
    return ~held


def _bread(jacobian: FloatArray) -> FloatArray:
    bread: FloatArray = np.asarray(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True), dtype=np.float64)
    return bread


def _meat(result: FitResult, jacobian: FloatArray) -> FloatArray:
    errors = residuals_by_record(result)
    shortest = min(error.size for error in errors)
    lags = int(min(4.0 * correlation_length(errors), shortest / 4))
    total = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    first = 0
    for error in errors:
        scores = jacobian[first : first + error.size] * error[:, None]
        first += error.size
        total += _long_run(scores, lags)
    n = result.residual.size
    meat: FloatArray = total * n / max(n - jacobian.shape[1], 1)
    return meat


def _long_run(scores: FloatArray, lags: int) -> FloatArray:
    """Sum the Bartlett-weighted cross products of the scores up to ``lags`` apart, by block differences.

    Bartlett weights over L lags are what overlapping blocks of length L give: the covariance of sums over a window,
    divided by its length. That costs one cumulative sum instead of L products.
    """
    window = max(lags, 1)
    padded = np.vstack([np.zeros((window, scores.shape[1])), scores, np.zeros((window - 1, scores.shape[1]))])
    sums = np.cumsum(padded, axis=0)
    blocks = sums[window:] - sums[:-window]
    product: FloatArray = blocks.T @ blocks / window
    return product


def interval(result: FitResult, cov: FloatArray, index: int) -> tuple[float, float]:
    """Return the 95 % interval of a shared parameter in its unit, by its index among the unknowns.

    It ends where the fit's bounds do: what the law allows, or the tolerance a nominal parameter is trusted to.
    """
    shared = result.problem.shared[index]
    spread = Z95 * float(np.sqrt(max(cov[index, index], 0.0)))
    x = min(max(float(result.x[index]), shared.low), shared.high)  # a fit may end beyond a bound by its last digit
    return (shared.scale * max(x - spread, shared.low), shared.scale * min(x + spread, shared.high))


def interval_that_follows(
    result: FitResult, cov: FloatArray, value_of: Callable[[FitResult], float]
) -> tuple[float, float]:
    """Return the 95 % interval of what follows from the unknowns, to first order; never of the other sign."""
    value, slope = value_of(result), np.zeros(result.x.size)
    for i in np.flatnonzero(np.diag(cov) > 0.0):
        moved = result.x.copy()
        moved[i] -= STEP
        slope[i] = (value - value_of(replace(result, x=moved))) / STEP
    spread = Z95 * float(np.sqrt(max(float(slope @ cov @ slope), 0.0)))
    low, high = value - spread, value + spread
    return (max(low, 0.0), high) if value > 0.0 else (low, min(high, 0.0))


def trusted(result: FitResult, index: int) -> tuple[float, float]:
    """Return what a nominal parameter is trusted to, in its unit: a fit that leaves physics out can't narrow it."""
    shared = result.problem.shared[index]
    return (shared.scale * shared.low, shared.scale * shared.high)


def interval_both_ways(result: FitResult, cov: FloatArray, index: int) -> tuple[float, float]:
    """Return the 95 % interval of a shared parameter that also holds it in the other parametrisation of the motion.

    There it is multiplied by a factor, itself estimated: ``d(x f) = f dx + x df``.
    """
    low, high = interval(result, cov, index)
    dimension = _dimension_in_line(result.problem.shared[index])
    factor, slope = _rescaled(result, result.x, dimension), np.zeros_like(result.x)
    if factor == 1.0:
        return low, high
    for i, shared in enumerate(result.problem.shared):
        if shared.effect and shared.low < shared.high:
            moved = result.x.copy()
            moved[i] += STEP
            slope[i] = result.x[index] * (_rescaled(result, moved, dimension) - factor) / STEP
    slope[index] += factor
    scale = result.problem.shared[index].scale
    other, spread = scale * factor * float(result.x[index]), scale * Z95 * float(np.sqrt(slope @ cov @ slope))
    return (min(low, other - spread), max(high, other + spread))


def _dimension_in_line(shared: Shared) -> str:
    """Return the dimension of a parameter of the line or of an effect in it; none of what stands before the line."""
    if not shared.effect:
        return parameter_dimension(shared.name)
    entry = EFFECTS[shared.effect]
    (dimension,) = (parameter.dimension for parameter in entry.parameters if parameter.name == shared.name)
    return "" if entry.element is Element.TORQUE_PATH else dimension


def _rescaled(result: FitResult, x: FloatArray, dimension: str) -> float:
    """Return the factor on a dimension in the other way to tell the same motion; 1 where there is none."""
    factor = 1.0
    for name, entry in EFFECTS.items():
        values = {s.name: float(x[i]) * s.scale for i, s in enumerate(result.problem.shared) if s.effect == name}
        if values:
            factor *= entry.rescaled(values).get(dimension, 1.0)
    return factor
