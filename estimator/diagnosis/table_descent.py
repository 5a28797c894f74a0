"""The fit of one curve in the free run, and what is reported of it: its values with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.table_curves import STRAIGHT, Curve, Masks
from estimator.least_squares import minimise
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import OBSERVER, slot
from estimator.physics.problem import Problem, bounds, outputs_at, residual_at
from estimator.physics.tables import DAMPING, Table
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray

Z95 = 1.96


class Descent:
    """The fit of one curve: unknowns are those of the line, the curve's slopes and damping, and the recordings' own."""

    def __init__(self, curve: Curve, result: FitResult, use: Masks) -> None:
        self.curve, self.problem = curve, curve.released(result, use)
        self.first = len(result.problem.shared)
        self.after = self.first + curve.pieces
        self._x0 = result.x
        self._scale = np.sqrt(max(result.squares, 1e-300) / 1000.0)
        low, high = bounds(self.problem)
        low[self.first : self.after], high[self.first : self.after] = curve.most
        self.low, self.high = low, high

    def start(self, slopes: FloatArray) -> FloatArray:
        """Return unknowns with these slopes, all else as the line had it."""
        own = [each.start for each in self.curve.more]
        return np.concatenate([self._x0[: self.first], slopes, own, self._x0[self.first :]])

    def x(self, z: FloatArray) -> FloatArray:
        """Return the scaled unknowns of the problem: values in the place of slopes."""
        x = z.copy()
        slopes = z[self.first : self.after] - self.curve.own
        x[self.first : self.after] = self.curve.values_of_slopes @ slopes
        return x

    def at(self, gain: float) -> Problem:
        """Return the problem simulated as an observer of the readings at a gain; at 0 it is a free run."""
        p = self.problem.p.copy()
        p[slot("", OBSERVER)] = gain
        return replace(self.problem, p=p)

    def fitted(self, z: FloatArray, gain: float, smooth: float, steps: int) -> tuple[FloatArray, float]:
        """Return unknowns after some steps at a gain, and the squared error there."""
        problem, seen = self.at(gain), dict[bytes, tuple[FloatArray, ...]]()
        of_curve = slice(self.first, self.after)
        each = np.eye(self.curve.pieces)
        penalty = np.sqrt(smooth) * np.vstack([np.diff(each, axis=0), 1e-2 * each])
        rows = np.zeros((penalty.shape[0], z.size))
        rows[:, of_curve] = penalty

        def outputs(z: FloatArray) -> tuple[FloatArray, ...]:
            key = z.tobytes()
            if key not in seen:
                seen.clear()
                seen[key] = outputs_at(problem, self.x(z))
            return seen[key]

        def residual(z: FloatArray) -> FloatArray:
            bent = penalty @ (z[of_curve] - self.curve.own)  # other unknowns may be infinite, as a limit of none is
            return np.concatenate([residual_at(problem, outputs(z)) / self._scale, bent])

        def jacobian(z: FloatArray) -> FloatArray:
            found = jacobian_at(problem, self.x(z), outputs(z))
            found[:, of_curve] = found[:, of_curve] @ self.curve.values_of_slopes
            return np.vstack([found / self._scale, rows])

        solution = minimise(residual, jacobian, z, self.low, self.high, steps)
        size = rows.shape[0]
        return solution.x, float(np.sum((self._scale * solution.residual[:-size]) ** 2))

    def error(self, z: FloatArray, masks: Masks) -> float:
        """Return the RMS of the free-run error over some samples."""
        return rms_over(self.at(0.0), outputs_at(self.at(0.0), self.x(z)), masks)


def rms_over(problem: Problem, outputs: Sequence[FloatArray], masks: Masks) -> float:
    """Return the RMS of the errors of first outputs over some samples, without those of a lead [unit of the output]."""
    rows = zip(problem.records, outputs, masks, strict=True)
    errors = [(out - record.output)[mask] for record, out, mask in rows if record.lead is None]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def with_curve(descent: Descent, z: FloatArray) -> FitResult:
    """Return the fit with the curve among what is given: a free run."""
    problem, x = descent.at(0.0), descent.x(z)
    outputs = outputs_at(problem, x)
    added = range(descent.first, descent.after + len(descent.curve.more))
    p = problem.p.copy()
    for i in added:
        p[problem.shared[i].slot] = problem.shared[i].scale * x[i]
    given = replace(problem, p=p, shared=problem.shared[: descent.first])
    return FitResult(given, np.delete(x, added), outputs, residual_at(problem, outputs), None, False)


def reported(descent: Descent, z: FloatArray) -> tuple[FitResult, Table]:
    """Return the fit with the curve among what is given, and the curve with its intervals."""
    problem, x, curve, fit = descent.at(0.0), descent.x(z), descent.curve, with_curve(descent, z)
    values = np.insert(x[descent.first : descent.after], curve.zero, 0.0)
    half = np.insert(_half_widths(descent, problem, x, fit.outputs, fit.residual), curve.zero, 0.0)
    bands = tuple((float(v - h), float(v + h)) for v, h in zip(values, half, strict=True))
    damping = float(fit.problem.p[slot(curve.name, DAMPING)]) if curve.more else 0.0
    return fit, Table(curve.place, tuple(curve.knots.tolist()), tuple(values.tolist()), bands, damping)


def _half_widths(
    descent: Descent, problem: Problem, x: FloatArray, outputs: Sequence[FloatArray], residual: FloatArray
) -> FloatArray:
    """Return half of the 95 % intervals of the values [Nm]: of errors that are worth fewer than they are."""
    derivative = jacobian_at(problem, x, outputs)
    for i, each in enumerate(problem.shared):
        if not each.effect and each.name == STRAIGHT.get(descent.curve.place):  # a recording tells their sum
            derivative[:, i] = 0.0
    free = np.flatnonzero(derivative.any(axis=0))
    j = derivative[:, free]
    variance = float(residual @ residual) / effective_samples([residual])
    scale = np.sqrt(np.maximum(np.diag(j.T @ j), 1e-300))
    inverse = np.linalg.pinv((j / scale).T @ (j / scale), rcond=1e-10, hermitian=True) / np.outer(scale, scale)
    spread = np.zeros(x.size)
    spread[free] = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance)
    return Z95 * spread[descent.first : descent.after]
