"""The torque at one place of the line, or the error of the reading, that by itself would explain a fit's error.

What the simulation lacks is taken for an unknown input of the linear line that whitens its errors, too (`line.py`): a
random walk, estimated with its standard error by a fixed-interval Kalman smoother (Durbin and Koopman, Time Series
Analysis by State Space Methods, chapter 4). How fast the walk may go is found by the marginal likelihood of the error,
and that likelihood tells how plausible the place is: at the right one a simple input explains the error, elsewhere it
takes a wild one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from estimator.compiled import compiled
from estimator.diagnosis.line.line import LinearLine, line_of
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.motion import speed_scale, torque_scale
from estimator.physics.parallel import concurrently
from estimator.signals.record import BoolArray, FloatArray

SLOWEST, FASTEST = 1e-3, 1e2
"""Range of the walk's rate, as a share of the torque or speed in use, per root second."""

INITIAL_SPREAD = 10.0
"""Before the first sample a state may be off by this many times its size in use; the input by its size in use."""

FORGETS_S = 1.0
"""A shaft torque that stays is invisible: it only holds another twist. Its walk returns to zero in about this time."""

SEARCH_TOLERANCE = 0.15  # of the rate's decimal logarithm: the likelihood is flat around its top

DRIVES = {Element.TORQUE_PATH: 1.0, Element.MOTOR: -1.0, Element.SHAFT: 1.0, Element.LOAD: 1.0}
"""Sign of a law at its place: the torque path drives the motor, friction at the motor brakes it."""


INPUTS = (Element.MOTOR, Element.SHAFT, Element.LOAD, Element.SPEED_SENSOR)
"""Where an unknown input may act: on the motor, in the shaft, against the load, on the reading."""

ACTS_AT = {Element.TORQUE_PATH: Element.MOTOR, Element.ACQUISITION: Element.SPEED_SENSOR}
"""Where a law of an element acts, if not there: an input alone does not distinguish those that act at one place."""


def places(result: FitResult) -> tuple[Element, ...]:
    """Return the places at which an unknown input may act on a line of this structure."""
    if result.problem.grid.structure is Structure.JOINT:
        return (Element.SHAFT,)
    if result.problem.grid.structure is Structure.ONE_MASS:
        return (Element.MOTOR, Element.SPEED_SENSOR)
    return INPUTS


def size_at(result: FitResult, place: Element) -> float:
    """Return the usual size of an input at a place: a torque [Nm], or a speed [rad/s] at the sensor."""
    records = result.problem.records
    return speed_scale(records) if place is Element.SPEED_SENSOR else torque_scale(records)


class Filtered(NamedTuple):
    """What the smoother needs of the filter: predictions, gains, surprises and their precision (0: not observed)."""

    means: FloatArray  # (N, n + 1): predicted state and input
    covariances: FloatArray  # (N, n + 1, n + 1) of these
    gains: FloatArray  # (N, n + 1): correction per unit of surprise
    surprises: FloatArray  # (N,): error less its prediction
    precisions: FloatArray  # (N,): one over their variance


@compiled
def row_times_column(a: FloatArray, row: int, b: FloatArray, column: int) -> float:
    """Return one entry of ``a b``."""
    total = 0.0
    for k in range(a.shape[1]):
        total += a[row, k] * b[k, column]
    return total


@compiled
def product(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Fill ``out`` with ``a b``; small matrices."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = row_times_column(a, i, b, j)


@compiled
def symmetric_product(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Fill ``out`` with ``a b`` where that is symmetric, and keep it so to the last bit."""
    for i in range(out.shape[0]):
        for j in range(i + 1):
            out[i, j] = row_times_column(a, i, b, j)
            out[j, i] = out[i, j]


@compiled
def observe(
    error: float, noise: float, h: FloatArray, mean: FloatArray, covariance: FloatArray, gain: FloatArray
) -> tuple[float, float]:
    """Correct the prediction by one observation; return the surprise and its precision, and fill the gain."""
    m = h.shape[0]
    surprise, spread = error, noise
    for r in range(m):
        total = 0.0
        for j in range(m):
            total += covariance[r, j] * h[j]
        gain[r] = total
        surprise -= h[r] * mean[r]
        spread += h[r] * total
    for r in range(m):
        mean[r] += gain[r] * surprise / spread
        for j in range(m):
            covariance[r, j] -= gain[r] * gain[j] / spread
    for r in range(m):
        gain[r] /= spread
    return surprise, 1.0 / spread


@compiled
def run_filter(
    f: FloatArray,
    h: FloatArray,
    walk: float,
    noise: float,
    prior: FloatArray,
    error: FloatArray,
    seen: BoolArray,
    kept: Filtered,
) -> float:
    """Return the log-likelihood of an error; keep what the smoother needs where ``kept`` has room.

    State and input move on by ``f``, (m, m), show by ``h``, (m,), and begin within ``prior``, (m, m); ``walk`` is the
    variance of the input's change from sample to sample, ``noise`` that of the reading.
    """
    m = h.shape[0]
    keep = kept.surprises.shape[0] > 0
    half, mean, moved, gain = np.zeros((m, m)), np.zeros(m), np.zeros(m), np.zeros(m)
    covariance = prior.copy()
    likelihood = 0.0
    for t in range(error.shape[0]):
        if keep:
            kept.means[t] = mean
            kept.covariances[t] = covariance
        if seen[t]:
            surprise, precision = observe(error[t], noise, h, mean, covariance, gain)
            likelihood -= 0.5 * (np.log(2.0 * np.pi / precision) + surprise * surprise * precision)
            if keep:
                kept.surprises[t] = surprise
                kept.precisions[t] = precision
                kept.gains[t] = gain
        for r in range(m):
            moved[r] = 0.0
            for j in range(m):
                moved[r] += f[r, j] * mean[j]
        mean[:] = moved
        product(f, covariance, half)
        symmetric_product(half, f.T, covariance)
        covariance[m - 1, m - 1] += walk
    return likelihood


@compiled
def fill_step(f: FloatArray, gain: FloatArray, h: FloatArray, step: FloatArray) -> None:
    """Fill how the filter's error moves on: ``f (1 - gain h')``."""
    m = h.shape[0]
    for r in range(m):
        pull = 0.0
        for j in range(m):
            pull += f[r, j] * gain[j]
        for j in range(m):
            step[r, j] = f[r, j] - pull * h[j]


@compiled
def run_smoother(f: FloatArray, h: FloatArray, kept: Filtered, value: FloatArray, variance: FloatArray) -> None:
    """Go back over what the filter kept: fill the input's estimate and its variance, each of shape (N,)."""
    m = h.shape[0]
    step, half = np.zeros((m, m)), np.zeros((m, m))
    score, back, information = np.zeros(m), np.zeros(m), np.zeros((m, m))
    for t in range(kept.surprises.shape[0] - 1, -1, -1):
        precision = kept.precisions[t]
        fill_step(f, kept.gains[t], h, step)
        for r in range(m):
            back[r] = h[r] * kept.surprises[t] * precision
            for j in range(m):
                back[r] += step[j, r] * score[j]
        score[:] = back
        product(information, step, half)
        product(step.T, half, information)
        own = kept.covariances[t, m - 1]
        value[t], variance[t] = kept.means[t, m - 1], own[m - 1]
        for r in range(m):
            value[t] += own[r] * score[r]
            for j in range(m):
                information[r, j] += h[r] * h[j] * precision
        for r in range(m):
            for j in range(m):
                variance[t] -= own[r] * information[r, j] * own[j]


@dataclass(frozen=True, slots=True)
class Input:
    """The input at one place of one recording; arrays of shape (N,)."""

    value: FloatArray  # estimate and its standard error
    std: FloatArray  # of ``value``


@dataclass(frozen=True, slots=True)
class Explanation:
    """The inputs at one place, one per recording."""

    place: Element  # of `INPUTS`, where they act
    inputs: tuple[Input, ...]  # in the order of the recordings
    rate: float  # standard deviation of the walk's change in one second [unit of the input]
    log_likelihood: float  # of the error, at the best rate


def explain(result: FitResult, place: Element, floor: float) -> Explanation:
    """Estimate the input at one place that explains a fit's error, each recording's in turn."""
    problem, size = result.problem, size_at(result, place)
    errors = [record.output - output for record, output in zip(problem.records, result.outputs, strict=True)]

    def deficit(exponent: float) -> float:
        chain = _chain(result, place, size * 10.0**exponent, floor)
        nothing = _room(0, chain.h.size)
        return -sum(run_filter(*chain, error, use, nothing) for error, use in zip(errors, problem.use, strict=True))

    best = minimize_scalar(
        deficit,
        bounds=(np.log10(SLOWEST), np.log10(FASTEST)),
        method="bounded",
        options={"xatol": SEARCH_TOLERANCE},
    )
    rate = size * 10.0 ** float(best.x)
    return Explanation(place, smoothed(result, errors, problem.use, place, rate, floor), rate, -float(best.fun))


def explain_all(result: FitResult, floor: float) -> dict[Element, Explanation]:
    """Estimate the input at every place; the compiled passes hold no interpreter lock and run side by side."""
    wanted = places(result)
    return dict(zip(wanted, concurrently(lambda place: explain(result, place, floor), wanted), strict=True))


def smoothed(
    result: FitResult,
    errors: Sequence[FloatArray],
    use: Sequence[BoolArray],
    place: Element,
    rate: float,
    floor: float,
) -> tuple[Input, ...]:
    """Estimate the input at one place that explains errors of each recording where they are seen, its rate given."""
    chain, found = _chain(result, place, rate, floor), []
    for error, seen in zip(errors, use, strict=True):
        kept, value, variance = _room(error.size, chain.h.size), np.zeros(error.size), np.zeros(error.size)
        run_filter(*chain, error, seen, kept)
        run_smoother(chain.f, chain.h, kept, value, variance)
        found.append(Input(value, np.sqrt(np.maximum(variance, 0.0))))
    return tuple(found)


class Chain(NamedTuple):
    """The line of n states as an input sees it, as `run_filter` takes it; its last state is the input."""

    f: FloatArray  # (n + 1, n + 1): how they move on
    h: FloatArray  # (n + 1,): how they show in the output
    walk: float  # variance of the input's change from sample to sample
    noise: float  # of the reading, its variance
    prior: FloatArray  # (n + 1, n + 1): covariance of their first values


def _chain(result: FitResult, place: Element, rate: float, floor: float) -> Chain:
    line, period_s, size = line_of(result), result.problem.records[0].sample_time_s, size_at(result, place)
    n, is_sensor = line.torque.size, place is Element.SPEED_SENSOR
    f, h, prior = np.zeros((n + 1, n + 1)), np.zeros(n + 1), np.zeros((n + 1, n + 1))
    f[:n, :n], f[n, n] = line.f, np.exp(-period_s / FORGETS_S) if place is Element.SHAFT else 1.0
    h[:n], h[n] = line.h[0], 1.0 if is_sensor else line.direct
    if not is_sensor:  # with an error of the reading the line itself is as simulated
        f[:n, n] = {Element.MOTOR: line.torque, Element.LOAD: line.load, Element.SHAFT: line.shaft}[place]
        prior[np.arange(n), np.arange(n)] = (INITIAL_SPREAD * _scales(result, line)) ** 2
    prior[n, n] = size**2
    return Chain(f, h, rate**2 * period_s, floor**2, prior)


def _scales(result: FitResult, line: LinearLine) -> FloatArray:
    """Return the size of each state in use, shape (n,): speeds and twists in turn; an angle stands last."""
    records, stiffness = result.problem.records, float(result.p[slot("", "k")])
    speed, torque = speed_scale(records), torque_scale(records)
    scales = np.resize([speed, torque / stiffness if stiffness > 0.0 else 1.0], line.torque.size)
    if scales.size % 2 == 0:
        scales[-1:] = 1.0
    return scales


def _room(rows: int, m: int) -> Filtered:
    return Filtered(np.zeros((rows, m)), np.zeros((rows, m, m)), np.zeros((rows, m)), np.zeros(rows), np.zeros(rows))
