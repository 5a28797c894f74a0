"""How far disturbances move the values of a model whose laws switch: what its intervals are made from.

The likelihood's own covariance takes the free run for its tangent, and disturbances for spread by the linear line. Both
are wrong where faces meet or friction turns. There the free run has kinks closer together than a value is known, so
that the slope at a point shows more than the recordings do; and what a disturbance makes of the motion grows from one
switch to the next. With a gap, intervals were short by a factor of five. So here

- the derivative is taken over the width of the intervals themselves (`with_secants`);
- disturbances are drawn in the sizes that were estimated and go through the model; the values follow to first order,
  and the spread of what they do beyond the linear line is added (`beyond_the_line`): a parametric bootstrap (Efron and
  Tibshirani, An Introduction to the Bootstrap, 1993, 6.5) of one Gauss-Newton step. A law's error of form is drawn once
  for all its switches: it is no noise that would cancel.

A linear line has neither: its intervals stay those of the likelihood.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.diagnosis.inference.descent import Weigh
from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.line.line import FormPlace, LinearLine, form_shifts, line_of
from estimator.physics.catalogue import KERNEL
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import secants_at
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.problem import outputs_at
from estimator.signals.record import BoolArray, FloatArray, by_output

LEAST, MOST = 1e-4, 1e-2
"""Widths of a scaled unknown over which a slope is taken: no closer than kinks are, no farther than a law stays one."""

ROUNDS = 2  # the first is over the width that the derivative at a point gives

DRAWS = 64  # the spread of a value is then known to 9 %

_NONLINEAR = tuple(
    (slot(entry.name, parameter.name), parameter.null)
    for entry in KERNEL.values()
    if entry.element in (Element.MOTOR, Element.SHAFT, Element.LOAD) and not entry.profile
    for parameter in entry.parameters[:1]
)
"""Decisive parameter of each effect by which a line is not linear, and its value where the effect is not there."""


def switches(result: FitResult) -> bool:
    """Tell whether a model is one that intervals are drawn for: simulated here, with a law that is not linear."""
    problem = result.problem
    if problem.grid.structure is Structure.JOINT or problem.grid.plant is not None:
        return False
    each = [result.p_of(i) for i in range(len(problem.bases))]
    return any(p[place] != null for p in each for place, null in _NONLINEAR)


def with_secants(result: FitResult, weigh: Weigh) -> FitResult:
    """Return a fit with its derivative over the width of its own intervals; ``weigh`` makes errors of variance 1."""
    if not switches(result):
        return result
    for _ in range(ROUNDS):
        white = weigh(result.jacobian)
        spread = np.sqrt(np.diag(np.linalg.pinv(white.T @ white, hermitian=True)))
        widths = np.clip(spread, LEAST, MOST)
        secants = secants_at(result.problem, result.x, result.outputs, widths)
        result = replace(result, derivative=secants, converged=True)
    return result


def beyond_the_line(result: FitResult, weigh: Weigh, sizes: FloatArray, free: BoolArray) -> FloatArray:
    """Return what disturbances add to the covariance of the scaled unknowns, shape (U, U), beyond the linear line.

    ``sizes`` is the noise model (`Size`), ``free`` which unknowns can move, shape (U,).
    """
    found = np.zeros((result.x.size, result.x.size))
    if not switches(result):
        return found
    white = weigh(result.jacobian[:, free])
    pull = np.linalg.pinv(white.T @ white, hermitian=True) @ white.T
    moved = np.array([pull @ weigh(errors) for errors in _beyond(result, sizes)])
    found[np.ix_(free, free)] = moved.T @ moved / DRAWS
    return found


def _beyond(result: FitResult, sizes: FloatArray) -> list[FloatArray]:
    """Return what each draw changes in the outputs that the linear line would not, stacked as the errors are, (R,)."""
    problem, line, rng = result.problem, line_of(result), np.random.default_rng(0)
    bases = range(len(problem.bases))
    draws = [_drawn(sizes, problem.records[i].time_s.size, problem.records[i].sample_time_s, rng) for i in bases]
    through_line = [_through(line, *draws[i]) for i in bases]
    shares = np.exp(sizes[Size.FORM]) * rng.standard_normal((DRAWS, len(FormPlace)))
    shifts = [form_shifts(result, i) for i in bases]
    output_of = {k: c for c, part in enumerate(by_output(problem.records)) for k in range(part.start, part.stop)}
    found = []
    for draw in range(DRAWS):
        records = list(problem.records)
        for i, drive in zip(bases, problem.drives, strict=True):
            motor, load, shaft = shares[draw][:, None] * shifts[i]
            torque = draws[i][0][draw] + motor - shaft
            against = draws[i][1][draw] + load - shaft
            for k in drive:
                inputs = records[k].torque_nm.copy()
                inputs[:, 0] += torque
                records[k] = replace(records[k], torque_nm=inputs, load_nm=records[k].known_load_nm + against)
        outputs = outputs_at(replace(problem, records=tuple(records)), result.x)
        rows = zip(outputs, result.outputs, problem.leads, problem.use, strict=True)
        found.append(
            np.concatenate(
                [(o - as_is - through_line[i][output_of[k]][draw])[use] for k, (o, as_is, i, use) in enumerate(rows)]
            )
        )
    return found


def _drawn(sizes: FloatArray, count: int, period_s: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return draws of the torque's error and of the load's walk, each of shape (DRAWS, N) [Nm]."""
    torque, drift, drift_s, walk = np.exp(sizes[[Size.TORQUE, Size.DRIFT, Size.DRIFT_S, Size.WALK]])
    kept = np.exp(-period_s / drift_s)
    steps = drift * np.sqrt(1.0 - kept**2) * rng.standard_normal((DRAWS, count))
    steps[:, 0] = drift * rng.standard_normal(DRAWS)
    drifts = np.empty_like(steps)
    now = np.zeros(DRAWS)
    for t in range(count):
        now = kept * now + steps[:, t]
        drifts[:, t] = now
    walked = np.cumsum(walk * np.sqrt(period_s) * rng.standard_normal((DRAWS, count)), axis=1)
    return torque * rng.standard_normal((DRAWS, count)) + drifts, walked


def _through(line: LinearLine, torque: FloatArray, load: FloatArray) -> FloatArray:
    """Return what the linear line makes of torques, each of shape (DRAWS, N): its outputs, shape (C, DRAWS, N)."""
    x = np.zeros((line.f.shape[0], torque.shape[0]))
    found = np.empty((line.h.shape[0], *torque.shape))
    for t in range(torque.shape[1]):
        found[:, :, t] = line.h @ x + line.direct * load[:, t]
        x = line.f @ x + np.outer(line.torque, torque[:, t]) + np.outer(line.load, load[:, t])
    return found
