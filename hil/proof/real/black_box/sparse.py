"""Sparse regression of the derivative (SINDy), with PySINDy's sequentially thresholded least squares.

::

    dx/dt = Theta(x, u) Xi,   Xi sparse

S. Brunton, J. Proctor, J. Kutz, "Discovering governing equations from data by sparse identification of nonlinear
dynamical systems", PNAS 113, 2016. The state is the output and, of a position, its rate too; rates are slopes over a
few samples. Degree and threshold are those of `DEGREES` and `THRESHOLDS` whose free run over the fitted data is best:
nothing is tuned by hand. In a free run the initial state and one constant in the last equation are each stretch's own.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from estimator.signals.record import FloatArray, IntArray, OutputKind
from hil.proof.real.black_box.features import free_runs, powers, table
from hil.proof.real.black_box.series import Stretch

DEGREES = (1, 2, 3)
"""Of the polynomials."""

THRESHOLDS = (3.0, 1.0, 0.3, 0.1, 0.03, 0.01)
"""Of coefficients [1/s] between signals that are scaled to one."""

SLOPE_SAMPLES = 7
"""A derivative is the slope of a quadratic through this many samples."""

RIDGE = 1e-6
"""Keeps the regression solvable where two features are alike; next to nothing against signals of one."""

STEPS = 8
"""Gauss-Newton steps for what is a stretch's own."""

DAMPINGS = (0.0, 1e-3, 1e-1, 10.0, 1e3)
"""Levenberg and Marquardt's, relative; each is tried and the best step taken."""

STEP = 1e-4
"""Finite difference, in scaled states."""


class PySindyMissing(Exception):
    """PySINDy is not installed; the black box is left out and its place says so."""


@dataclass(frozen=True, slots=True, eq=False)
class SparseModel:
    """A sparse law for the rate of scaled states.

    Attributes
    ----------
    xi : ndarray, shape (S, K + 2 (S + M))
        Coefficients.
    exponents : ndarray, shape (K, S + M)
        Of the monomials.
    x_scale, u_scale : ndarray, shape (S,), (M,)
        What one means in states and inputs.
    """

    xi: FloatArray
    exponents: IntArray
    x_scale: FloatArray
    u_scale: FloatArray

    def runs(self, stretch: Stretch, own: FloatArray) -> FloatArray:
        """Return free runs from P sets of scaled initial state and constant, (P, S + 1), as outputs (P, n)."""
        inputs = np.ascontiguousarray(stretch.inputs / self.u_scale)
        found = free_runs(np.ascontiguousarray(own), inputs, self.xi, self.exponents, stretch.sample_time_s)
        scaled: FloatArray = found * self.x_scale[0]
        return scaled


def require_pysindy() -> Any:
    """Return the PySINDy module.

    Raises
    ------
    PySindyMissing
        If it is not installed.
    """
    try:
        return importlib.import_module("pysindy")
    except ModuleNotFoundError as error:
        raise PySindyMissing(
            f"expected PySINDy for the sparse regression, got: {error}. Install pysindy into the environment."
        ) from error


def states(stretch: Stretch) -> FloatArray:
    """Return the output and, of a position, its rate; shape (n, S)."""
    if stretch.kind is not OutputKind.POSITION:
        return stretch.output[:, np.newaxis]
    return np.column_stack([stretch.output, _slope(stretch.output, stretch.sample_time_s)])


def _slope(values: FloatArray, sample_time_s: float) -> FloatArray:
    slope: FloatArray = savgol_filter(values, SLOPE_SAMPLES, 2, deriv=1, delta=sample_time_s, axis=0)
    return slope


def fit_sparse(stretches: Sequence[Stretch]) -> SparseModel:
    """Fit a sparse law to stretches of recordings; the threshold is chosen by free runs over the same.

    Raises
    ------
    PySindyMissing
        If PySINDy is not installed.
    """
    pysindy = require_pysindy()
    x_scale = np.maximum(np.std(np.concatenate([states(s)[s.used] for s in stretches]), axis=0), 1e-300)
    u_scale = np.maximum(np.std(np.concatenate([s.inputs[s.used] for s in stretches]), axis=0), 1e-300)
    rows = [_regression(stretch, x_scale, u_scale) for stretch in stretches]
    z, rate = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    models = []
    for degree, threshold in product(DEGREES, THRESHOLDS):
        exponents = powers(z.shape[1], degree)
        optimiser = pysindy.STLSQ(threshold=threshold, alpha=RIDGE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a threshold that leaves no term: its free run will tell
            xi = np.asarray(optimiser.fit(table(z, exponents), rate).coef_, dtype=np.float64)
        models.append(SparseModel(xi, exponents, x_scale, u_scale))
    return min(models, key=lambda model: _squares(model, stretches))


def _regression(stretch: Stretch, x_scale: FloatArray, u_scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return scaled signals and rates of the samples around which all is used."""
    x = states(stretch) / x_scale
    rate = _slope(x, stretch.sample_time_s)
    whole = np.convolve(~stretch.used, np.ones(SLOPE_SAMPLES), mode="same") == 0
    return np.column_stack([x, stretch.inputs / u_scale])[whole], rate[whole]


def _squares(model: SparseModel, stretches: Sequence[Stretch]) -> float:
    errors = [(simulate_sparse(model, stretch) - stretch.output)[stretch.used] for stretch in stretches]
    return float(sum(error @ error for error in errors))


def simulate_sparse(model: SparseModel, stretch: Stretch) -> FloatArray:
    """Return the free run over a stretch, its own constant and initial state estimated where it is used; shape (n,)."""
    own = np.append(states(stretch)[0] / model.x_scale, 0.0)
    for _ in range(STEPS):
        runs = model.runs(stretch, np.vstack([own, own + STEP * np.eye(own.size)]))
        error = (runs[0] - stretch.output)[stretch.used]
        trials = own + _steps(((runs[1:] - runs[0]) / STEP)[:, stretch.used].T, error)
        errors = (model.runs(stretch, trials) - stretch.output)[:, stretch.used]
        squares = np.sum(errors**2, axis=1)
        if squares.min() >= float(error @ error):
            break
        own = trials[int(np.argmin(squares))]
    best: FloatArray = model.runs(stretch, own[np.newaxis])[0]
    return best


def _steps(jacobian: FloatArray, error: FloatArray) -> FloatArray:
    """Return a step for each damping, shape (D, S + 1)."""
    normal = jacobian.T @ jacobian
    scale = np.diag(np.maximum(np.diag(normal), np.finfo(np.float64).tiny))
    gradient = jacobian.T @ error
    return np.array([-np.linalg.lstsq(normal + damping * scale, gradient, rcond=None)[0] for damping in DAMPINGS])
