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

from estimator.compiled import compiled
from estimator.diagnosis.line.line import LinearLine, line_of
from estimator.diagnosis.line.whitening import (
    StateSpace,
    correct,
    innovations_of,
    predict,
    shown,
    surprise,
    terms_of,
)
from estimator.lanes import LANES
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

ZOOMS = 3  # rounds of rates around the best so far, side by side: to 6 %, where the likelihood is flat

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
    """What the smoother needs of the filter: predictions of state and input, gains, innovations and their precision."""

    means: FloatArray  # (N, m): state and input, as predicted
    own: FloatArray  # (N, m): covariances of the input, which stands last, with these
    gains: FloatArray  # (N, m): correction per unit of innovation
    innovations: FloatArray  # (N,): error less its prediction
    precisions: FloatArray  # (N,): one over their variance; 0: not observed


@compiled
def run_filter(model: StateSpace, error: FloatArray, seen: BoolArray, p: FloatArray, kept: Filtered) -> None:
    """Filter an error, shape (N,), where it was seen; keep what the smoother needs.

    ``p``, shape (m m,), is the covariance of the first state and input, which is written over.
    """
    m = kept.means.shape[1]
    x, moved, ph, half = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m * m)
    for t in range(error.shape[0]):
        kept.means[t], kept.own[t] = x, p[m * (m - 1) :]
        if seen[t]:
            s = surprise(model.h, 0, model.r, p, ph, m)
            e = error[t] - shown(model.h, 0, x)
            correct(p, ph, s, m)
            kept.gains[t], kept.innovations[t], kept.precisions[t] = ph / s, e, 1.0 / s
            x += kept.gains[t] * e
        moved[:] = 0.0
        for n in range(model.f.rows.size):
            moved[model.f.rows[n]] += model.f.values[n] * x[model.f.columns[n]]
        x[:] = moved
        predict(model.f, model.q, p, half, m)


@compiled
def run_smoother(f: FloatArray, h: FloatArray, kept: Filtered, value: FloatArray, variance: FloatArray) -> None:
    """Go back over what the filter kept: fill the input's estimate and its variance, each of shape (N,).

    ``f``, (m, m), and ``h``, (m,), are how state and input move on and how they show.
    """
    m = h.shape[0]
    score, information = np.zeros(m), np.zeros((m, m))
    for t in range(kept.innovations.shape[0] - 1, -1, -1):
        precision = kept.precisions[t]
        step = f - np.outer(f @ kept.gains[t], h)  # how the filter's error moves on
        score = step.T @ score + h * (kept.innovations[t] * precision)
        information = step.T @ (information @ step) + np.outer(h, h) * precision
        value[t] = kept.means[t, m - 1] + kept.own[t] @ score
        variance[t] = kept.own[t, m - 1] - kept.own[t] @ (information @ kept.own[t])


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
    low, high, best, highest = SLOWEST, FASTEST, SLOWEST, -np.inf
    for _ in range(ZOOMS):
        rates = np.geomspace(low, high, LANES)
        found = _log_likelihoods(_models(result, place, size * rates, floor), errors, problem.use)
        top = int(np.argmax(found))
        if found[top] > highest:
            best, highest = float(rates[top]), float(found[top])
        low, high = rates[max(top - 1, 0)], rates[min(top + 1, LANES - 1)]
    return Explanation(place, smoothed(result, errors, problem.use, place, size * best, floor), size * best, highest)


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
    model, found = _models(result, place, np.array([rate]), floor).at(0), []
    m = model.at_input.shape[1]
    (f, h), line = np.zeros((2, m, m)), model.f
    f[line.rows, line.columns], h[model.h.rows, model.h.columns] = line.values, model.h.values
    for error, seen in zip(errors, use, strict=True):
        value, variance = np.zeros((2, error.size))
        kept = Filtered(*np.zeros((3, error.size, m)), *np.zeros((2, error.size)))
        run_filter(model, error, seen, model.prior.copy(), kept)
        run_smoother(f, h[0], kept, value, variance)
        found.append(Input(value, np.sqrt(np.maximum(variance, 0.0))))
    return tuple(found)


def _log_likelihoods(models: StateSpace, errors: Sequence[FloatArray], use: Sequence[BoolArray]) -> FloatArray:
    """Return the log-likelihood of errors of recordings where they are seen, under each of `LANES` models."""
    total = np.zeros(LANES)
    for error, seen in zip(errors, use, strict=True):
        values, variances = innovations_of(models, seen[:, np.newaxis], np.zeros((seen.size, 0)), error[seen])
        total -= 0.5 * np.sum(np.log(2.0 * np.pi * variances) + values**2 / variances, axis=0)
    return total


def _models(result: FitResult, place: Element, rates: FloatArray, floor: float) -> StateSpace:
    """Return the line and an input at a place, its last state, whose walk has each of some rates, shape (L,)."""
    line, period_s, size = line_of(result), result.problem.records[0].sample_time_s, size_at(result, place)
    n, is_sensor, count = line.torque.size, place is Element.SPEED_SENSOR, rates.size
    f, h, prior = np.zeros((n + 1, n + 1)), np.zeros((1, n + 1)), np.zeros((n + 1, n + 1))
    f[:n, :n], f[n, n] = line.f, np.exp(-period_s / FORGETS_S) if place is Element.SHAFT else 1.0
    h[0, :n], h[0, n] = line.h[0], 1.0 if is_sensor else line.direct
    if not is_sensor:  # with an error of the reading the line itself is as simulated
        f[:n, n] = {Element.MOTOR: line.torque, Element.LOAD: line.load, Element.SHAFT: line.shaft}[place]
        prior[np.arange(n), np.arange(n)] = (INITIAL_SPREAD * _scales(result, line)) ** 2
    prior[n, n] = size**2
    q = np.zeros(((n + 1) ** 2, count))
    q[-1] = rates**2 * period_s
    each = np.ones(count)
    return StateSpace(
        terms_of(f[..., np.newaxis] * each),
        terms_of(h),
        q,
        np.full((1, count), floor**2),
        prior.reshape(-1, 1) * each,
        np.zeros((0, n + 1)),
        np.zeros((0, count)),
    )


def _scales(result: FitResult, line: LinearLine) -> FloatArray:
    """Return the size of each state in use, shape (n,): speeds and twists in turn; an angle stands last."""
    records, stiffness = result.problem.records, float(result.p[slot("", "k")])
    speed, torque = speed_scale(records), torque_scale(records)
    scales = np.resize([speed, torque / stiffness if stiffness > 0.0 else 1.0], line.torque.size)
    if scales.size % 2 == 0:
        scales[-1:] = 1.0
    return scales
