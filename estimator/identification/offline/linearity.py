"""Whether a linear model is enough: a score test on what makes a driveline's response nonlinear.

With the linear model right, its innovation w(t) is independent of everything that was known at t - 1, so also of any
nonlinear function of the torque in the shaft or of the speed. Piecewise linear functions of both, whose knots lie at
quantiles, at zero torque (a gap) and at standstill (dry friction), drive the model as inputs of their own; w is
regressed on their whitened responses next to its own gradient (T. S. Breusch and A. R. Pagan, Review of Economic
Studies 47, 1980; an LM test in its F form, which holds in closed loop as well)::

    F = ((S_0 - S_1) / q) / (S_1 / (n - p - q))
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import lfilter
from scipy.stats import f as fisher
from threadpoolctl import threadpool_limits

from estimator.identification.linear_model import LinearModel
from estimator.identification.modes.modes import Mode, resonance
from estimator.identification.offline.problem import Problem, descended
from estimator.identification.offline.starts import delayed
from estimator.signals.decimate import Decimator
from estimator.signals.record import BoolArray, FloatArray, Record

SIGNIFICANCE = 1e-4
"""Of the test: linear drives in closed loop gave p-values somewhat smaller than uniform ones, gaps below 1e-15."""

LEAST_EFFECT = 0.1
"""Part of the innovations from which on a nonlinearity matters: what 30 s at 10 ms just show. Of a million samples the
test alone would call every drive nonlinear."""

QUANTILES = (0.1, 0.35, 0.65, 0.9)  # knots of the piecewise linear functions, of the signal's own distribution
LAGS = (1, 2, 3)  # numerators of the responses, in samples of the noise model: as many as a two-mass drive has

REGIONS = 3  # of equal numbers of samples: below, about and above the middle

MOST_DERIVATIVES = 30  # for the model of a region, which begins at that of the whole


@dataclass(frozen=True, slots=True)
class Linearity:
    """The test's result."""

    p_value: float  # probability of an F at least this large on a linear drive
    by_torque: float  # the same for functions of the shaft's torque alone, and of the speed alone
    by_speed: float  # ... of functions of the speed alone
    effect: float = 1.0  # what the functions explain of the innovations beyond chance, RMS over RMS

    @property
    def is_linear(self) -> bool:
        """Tell whether nothing that matters speaks against a linear model."""
        return self.p_value > SIGNIFICANCE or self.effect < LEAST_EFFECT

    @property
    def depends_on(self) -> str:
        """What the response depends on, the stronger evidence first."""
        return "the torque in the shaft" if self.by_torque <= self.by_speed else "the speed"


def judge_linearity(problem: Problem, x: FloatArray, record: Record, first: int, high_pass_hz: float) -> Linearity:
    """Test a Box-Jenkins fit."""
    model = problem.model(x)
    u, okay = record.total_torque_nm[first:], record.okay[first:]
    rows = np.arange(okay.shape[0])
    y = np.interp(rows, rows[okay], record.output[first:][okay])
    groups = [_knotted(shaft_torque(model, u)), _knotted(delayed(y, 1), settled=y[0])]
    with threadpool_limits(1):
        J, w = problem.jacobian(x), problem.residual(x)
        columns = [_responses(problem, x, model, group, high_pass_hz) for group in groups]
        (p_value, effect), *alone = (_tested(J, w, c) for c in (np.column_stack(columns), *columns))
    (by_torque, _), (by_speed, _) = alone
    return Linearity(p_value, by_torque, by_speed, effect)


def shaft_torque(model: LinearModel, u: FloatArray) -> FloatArray:
    """Return the torque through the pair of poles of least damping, gain 1: nearly that in the shaft, shape (N,)."""
    pairs = model.poles[model.poles.imag > 0.0]
    if not pairs.size:
        return u
    z = pairs[np.argmax(np.abs(pairs))]
    section = np.array([1.0, -2.0 * z.real, abs(z) ** 2])
    return np.asarray(u[0] + lfilter([0.0, section.sum()], section, u - u[0]), dtype=np.float64)


def _knotted(signal: FloatArray, settled: float | None = None) -> FloatArray:
    """Return the part of a signal above each knot, shape (N, knots); a knot at 0 where it changes sign."""
    if settled is not None:
        signal = np.concatenate([[settled], signal[1:]])
    knots = np.quantile(signal, QUANTILES)
    if knots[0] < 0.0 < knots[-1]:
        knots = np.append(knots, 0.0)
    return np.asarray(np.maximum(signal[:, np.newaxis] - knots, 0.0), dtype=np.float64)


def _responses(
    problem: Problem, x: FloatArray, model: LinearModel, inputs: FloatArray, high_pass_hz: float
) -> FloatArray:
    chain = [Decimator(problem.sample_time_s, 1, high_pass_hz) for _ in inputs.T]
    passed = [one.run(f, f, np.ones(f.shape, dtype=np.bool_)).u for one, f in zip(chain, inputs.T, strict=True)]
    filtered = [lfilter([1.0], model.A, f) for f in passed]
    lagged = np.column_stack([delayed(f, lag * problem.block) for f in filtered for lag in LAGS])
    return problem.whitened(x, lagged)


def _tested(J: FloatArray, w: FloatArray, columns: FloatArray) -> tuple[float, float]:
    """Return the probability of so large a fall of the sum of squares by chance, and the root of its share beyond."""
    basis, _ = np.linalg.qr(J / np.maximum(np.linalg.norm(J, axis=0), np.finfo(np.float64).tiny))
    rest = w - basis @ (basis.T @ w)
    extra = columns - basis @ (basis.T @ columns)
    left, sizes, _ = np.linalg.svd(extra / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), full_matrices=False)
    left = left[:, sizes > 1e-6 * sizes[0]]
    q, free = left.shape[1], w.shape[0] - J.shape[1] - left.shape[1]
    gained, total = float(np.sum((left.T @ rest) ** 2)), float(rest @ rest)
    if q == 0 or free <= 0 or total <= gained:
        return 1.0, 0.0
    variance = (total - gained) / free
    return float(fisher.sf(gained / q / variance, q, free)), float(np.sqrt(max(gained - q * variance, 0.0) / total))


@dataclass(frozen=True, slots=True)
class RegionalMode:
    """The resonance where a signal is between two values; None where the drive does not resonate there."""

    low: float  # smallest value of the signal in the region, in its unit
    high: float  # largest
    mode: Mode | None  # frequency and damping ratio there


def modes_by_region(
    problem: Problem, x: FloatArray, signal: FloatArray, band_hz: tuple[float, float]
) -> tuple[RegionalMode, ...]:
    """Return the resonance in each of REGIONS regions of a signal (N,), looked for in a band [Hz]."""
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
        return problem.model(joined(descended(residual, jacobian, x[:n], MOST_DERIVATIVES)))
