"""How well values are known: their covariance, of errors that are correlated and of laws that switch.

The intervals hold although the errors are correlated (`covariance`), and although a part of them is no noise
(`reported_covariance`).

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

import math
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.descent import Weigh
from estimator.diagnosis.inference.disturbances import Size
from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.inference.remainder import residuals_by_record, unpredictable
from estimator.diagnosis.line.line import FormPlace, LinearLine, form_shifts, line_of
from estimator.diagnosis.thresholds import Intervals, Telling
from estimator.physics.catalogue import KERNEL
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import secants_at
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.problem import outputs_at
from estimator.signals.correlation import correlation_length
from estimator.signals.record import BoolArray, FloatArray, by_output

Z95 = 1.959963984540054  # 97.5 % point of the normal distribution

ROUNDS = 2  # the first is over the width that the derivative at a point gives

DRAWS = 64  # the spread of a value is then known to 9 %

_NONLINEAR = tuple(
    (slot(entry.name, parameter.name), parameter.null)
    for entry in KERNEL.values()
    if entry.element in (Element.MOTOR, Element.SHAFT, Element.LOAD) and not entry.profile
    for parameter in entry.parameters[:1]
)
"""Decisive parameter of each effect by which a line is not linear, and its value where the effect is not there."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """The fit that values and intervals are taken from, and how well its unknowns are known."""

    fit: FitResult  # of independent innovations where these are all that is left; else of the free run
    covariance: FloatArray  # (U, U): of its scaled unknowns


def estimate_of(believed: Hypothesis, is_whole: bool, free: FitResult) -> Estimate:
    """Return what values are taken from: of a hypothesis that leaves nothing but its disturbances, or of a free run."""

    def weigh(errors: FloatArray) -> FloatArray:
        return believed.filter(errors) if is_whole else errors / free.rms

    plain = with_secants(believed.result if is_whole else free, weigh)
    fit = replace(believed, result=plain).white if is_whole else plain
    fitted_s, period_s = (each.problem.records[0].sample_time_s for each in (believed.result, plain))
    sizes = believed.sizes.copy()
    sizes[Size.TORQUE] += 0.5 * math.log(fitted_s / period_s)  # of one sample, where these are closer together
    along = reported_covariance(fit)
    return Estimate(fit, along + beyond_the_line(plain, weigh, sizes, free_unknowns(fit)))


def covariance(result: FitResult) -> FloatArray:
    """Return the covariance of the scaled unknowns, shape (U, U), by the sandwich formula.

    ``C = B M B`` with ``B = (J'J)^-1`` and ``M`` the long-run covariance of the scores ``J_k e_k``, Bartlett
    weights over several correlation lengths of the error (Newey and West, Econometrica 55, 1987). An effect's
    parameter at a bound of its law is held there and has no variance. A nominal parameter at the edge of its tolerance
    is not: the tolerance is a belief about it, and how well the data determine it does not change there.
    """
    return _sandwich(result, free_unknowns(result))


def _sandwich(result: FitResult, free: BoolArray) -> FloatArray:
    j = result.jacobian[:, free]
    bread = _bread(j)
    full = np.zeros((result.x.size, result.x.size))
    full[np.ix_(free, free)] = bread @ _meat(result, j) @ bread
    return full


def reported_covariance(result: FitResult) -> FloatArray:
    """Return the covariance that intervals are reported from, shape (U, U): of the noise, and of what is no noise.

    The part of the error that its own past predicts is physics written another way, or the torque reading's own
    noise. It pulls the unknowns as an error would that keeps its value for ``COHERENT_S``: its mean square times that
    many samples takes the place of the noise's variance in ``sigma^2 (J'J)^-1``. A parameter that ended at a bound of
    its law has the variance that it would have without the bound, by itself: its interval goes one way, from the bound.
    """
    free, coherent = free_unknowns(result), coherent_variance(result)

    def reported(free: BoolArray) -> FloatArray:
        full = _sandwich(result, free)
        full[np.ix_(free, free)] += coherent * _bread(result.jacobian[:, free])
        return full

    full, each = reported(free), np.arange(result.x.size)
    for i in (i for i, shared in enumerate(result.problem.shared) if not free[i] and shared.low < shared.high):
        full[i, i] = reported(free | (each == i))[i, i]
    return full


def coherent_variance(result: FitResult) -> float:
    """Return the mean square of the error that is no noise, times the samples for which it keeps its value."""
    coherent = max(result.rms**2 - unpredictable(residuals_by_record(result)) ** 2, 0.0)
    return coherent * Telling.COHERENT_S / min(record.sample_time_s for record in result.problem.records)


def free_unknowns(result: FitResult) -> BoolArray:
    """Return which unknowns have a variance, shape (U,): all but parameters of effects at a bound of their law."""
    held = result.pinned
    of_effects = np.array([bool(shared.effect) for shared in result.problem.shared], dtype=np.bool_)
    held[: of_effects.size] &= of_effects
    return ~held


def _bread(jacobian: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True), dtype=np.float64)


def _meat(result: FitResult, jacobian: FloatArray) -> FloatArray:
    errors = residuals_by_record(result)
    shortest = min(error.size for error in errors)
    lags = int(min(Intervals.LAGS * correlation_length(errors), shortest / Intervals.LAG_SHARE))
    total = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    first = 0
    for error in errors:
        scores = jacobian[first : first + error.size] * error[:, None]
        first += error.size
        total += _long_run(scores, lags)
    n = result.residual.size
    return total * n / max(n - jacobian.shape[1], 1)


def _long_run(scores: FloatArray, lags: int) -> FloatArray:
    """Sum the Bartlett-weighted cross products of the scores up to a distance of ``lags``, by block differences."""
    window = max(lags, 1)
    padded = np.vstack([np.zeros((window, scores.shape[1])), scores, np.zeros((window - 1, scores.shape[1]))])
    sums = np.cumsum(padded, axis=0)
    blocks = sums[window:] - sums[:-window]
    return blocks.T @ blocks / window


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
        widths = np.clip(spread, Intervals.LEAST_WIDTH, Intervals.MOST_WIDTH)
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
