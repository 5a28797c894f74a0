"""The size found with a given power: a logistic curve over the logarithm of the size.

Parameters are the logarithm m of that size and the steepness b: logit p = logit(power) + b (log s - m). The likelihood
carries Firth's penalty (Biometrika 80, 1993), without which trials that a size separates perfectly have no estimate;
the interval is that of the profile of m. Both are read off a grid, so nothing can fail to converge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from hil.proof.power.bound import POWER
from hil.proof.truth.physics import FloatArray

STEEPNESS = np.geomspace(0.5, 60.0, 60)
"""Of the curve; the best test's has about 8."""

SIZES = 400
"""Points of the grid of sizes."""

MARGIN = 4.0
"""Factor beyond the least and the greatest size tried within which an estimate is given."""

_WITHIN = 0.5 * float(stats.chi2.ppf(0.95, 1))


@dataclass(frozen=True, slots=True)
class Curve:
    """A fitted curve.

    Attributes
    ----------
    size : float
        Found with `POWER`; infinite where the trials don't reach so far, 0 where all were found.
    low, high : float
        Its 95 % interval; 0 or infinite where it is open.
    steepness : float
        Slope of logit p over log size.
    """

    size: float
    low: float
    high: float
    steepness: float

    def power(self, size: float) -> float:
        """Return the probability of finding a size; NaN where no size was fitted."""
        if not 0.0 < self.size < math.inf:
            return math.nan
        return float(special.expit(special.logit(POWER) + self.steepness * math.log(size / self.size)))


def fit_curve(sizes: Sequence[float], found: Sequence[bool]) -> Curve:
    """Fit the probability of finding a size.

    Parameters
    ----------
    sizes
        Of the trials, greater than 0.
    found
        Whether each was.

    Raises
    ------
    ValueError
        If there are no trials, or not one answer for each.
    """
    if not sizes or len(sizes) != len(found):
        raise ValueError(f"trials: expected as many answers as sizes and at least one, got {len(sizes)} {len(found)}")
    x, hit = np.log(np.asarray(sizes)), np.asarray(found, dtype=np.bool_)
    grid = np.linspace(x.min() - math.log(MARGIN), x.max() + math.log(MARGIN), SIZES)
    level = np.array([_penalised(x, hit, grid, float(b)) for b in STEEPNESS])
    profile = level.max(axis=0)
    best = int(profile.argmax())
    inside = np.flatnonzero(profile >= profile[best] - _WITHIN)
    last = SIZES - 1
    size = math.inf if best == last or not hit.any() else math.exp(grid[best])
    return Curve(
        size=0.0 if hit.all() else size,
        low=0.0 if inside[0] == 0 else math.exp(grid[inside[0]]),
        high=math.inf if inside[-1] == last else math.exp(grid[inside[-1]]),
        steepness=float(STEEPNESS[int(level[:, best].argmax())]),
    )


def _penalised(x: FloatArray, hit: NDArray[np.bool_], log_sizes: FloatArray, steepness: float) -> FloatArray:
    """Return log likelihoods with half the logarithm of the information's determinant, of the shape of log_sizes."""
    logit = special.logit(POWER) + steepness * (x - log_sizes[:, None])
    likelihood = special.log_expit(np.where(hit, logit, -logit)).sum(axis=1)
    weight = special.expit(logit) * special.expit(-logit)
    determinant = weight.sum(axis=1) * (weight @ x**2) - (weight @ x) ** 2
    penalised: FloatArray = likelihood + 0.5 * np.log(np.maximum(determinant, math.ulp(0.0)))
    return penalised
