"""The resonance by operating region: on what its frequency and damping depend where the drive is not linear.

The whitened equations of a Box-Jenkins fit hold row by row, so B / A can be fitted to the rows alone in which a signal
lies in a region, D and everything before them as they are. Each region's model is the linear drive that answers like
the real one there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import Mode, resonance
from estimator.identification.offline.problem import Problem
from estimator.signals.record import BoolArray, FloatArray

REGIONS = 3
"""Of equal numbers of samples: below, about and above the middle."""

MOST_EVALUATIONS = 30


@dataclass(frozen=True, slots=True)
class RegionalMode:
    """The resonance where a signal is between two values; None where the drive does not resonate there."""

    low: float
    high: float
    mode: Mode | None


def modes_by_region(
    problem: Problem, x: FloatArray, signal: FloatArray, band_hz: tuple[float, float]
) -> tuple[RegionalMode, ...]:
    """Fit B / A once for each region of a signal.

    Parameters
    ----------
    problem : Problem
        Of a Box-Jenkins fit.
    x : ndarray
        Its minimum.
    signal : ndarray, shape (N,)
        What the regions are of, e.g. the torque in the shaft [Nm].
    band_hz : tuple of float
        Where the resonance is looked for [Hz].
    """
    value = problem.blocks.mean(signal)[problem.noise_order :]
    edges = np.quantile(value, np.linspace(0.0, 1.0, REGIONS + 1))
    found = []
    for low, high in pairwise(edges.tolist()):
        model = _model_of(problem, x, (value >= low) & (value <= high))
        found.append(RegionalMode(low, high, resonance(model, band_hz)))
    return tuple(found)


def _model_of(problem: Problem, x: FloatArray, rows: BoolArray) -> LinearModel:
    """Return the model that whitened rows alone ask for."""
    n = problem.n_plant

    def joined(plant: FloatArray) -> FloatArray:
        return np.concatenate([plant, x[n:]])

    def residual(plant: FloatArray) -> FloatArray:
        return problem.residual(joined(plant))[rows]

    def jacobian(plant: FloatArray) -> FloatArray:
        return problem.jacobian(joined(plant))[rows, :n]

    with threadpool_limits(1):
        solution = least_squares(residual, x[:n], jac=jacobian, x_scale="jac", method="lm", max_nfev=MOST_EVALUATIONS)
    return problem.model(joined(solution.x))
