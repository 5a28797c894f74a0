"""The torque at one place of the line, or the error of the reading, that by itself would explain a fit's error.

What the simulation lacks is taken for an unknown input of the linearised line: a random walk, estimated with its
standard error by a fixed-interval Kalman smoother (Durbin and Koopman, Time Series Analysis by State Space Methods,
chapter 4). How fast the walk may go is found by the marginal likelihood of the error, and that likelihood tells how
plausible the place is: at the right one a simple input explains the error, elsewhere it takes a wild one.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from estimator.compiled import compiled
from estimator.diagnosis.line.blocks import FORCES, BlockedRecording, InputPlace, Motion, places, size_at
from estimator.diagnosis.line.tangent import LOAD, MOTOR
from estimator.physics.fit import FitResult
from estimator.physics.kernel import state_vector
from estimator.signals.record import FloatArray

SLOWEST, FASTEST = 1e-3, 1e2
"""Range of the walk's rate, as a share of the torque or speed in use, per root second."""

INITIAL_SPREAD = 10.0
"""Before the first sample a state may be off by this many times its size in use; the input by its size in use."""

FORGETS_S = 1.0
"""A shaft torque that stays is invisible: it only holds another twist. Its walk returns to zero in about this time."""

SEARCH_TOLERANCE = 0.15  # of the rate's decimal logarithm: the likelihood is flat around its top


class Chain(NamedTuple):
    """The line as the input sees it, over B blocks, or 1 that stands for all."""

    phi: FloatArray  # (B, n, n): how the state moves on
    drive: FloatArray  # (B, n): how the input acts on it
    c: FloatArray  # (B, n): how state and input show in the output
    direct: FloatArray  # (B, n): how state and input show in the output
    memory: float  # share of the input that is there in the next block
    walk: float  # variance of its change from block to block


class Filtered(NamedTuple):
    """What the smoother needs of the filter: predictions, gains, surprises and their precision (0: not observed)."""

    means: FloatArray  # (B, n + 1): predicted state and input
    covariances: FloatArray  # (B, n + 1, n + 1) of these
    gains: FloatArray  # (B, n + 1): correction per unit of surprise
    surprises: FloatArray  # (B,): error less its prediction
    precisions: FloatArray  # (B,): one over their variance


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
def load(chain: Chain, block: int, f: FloatArray, h: FloatArray) -> None:
    """Fill the transition and the observation of one block."""
    n = chain.phi.shape[1]
    i = block if chain.phi.shape[0] > 1 else 0
    for r in range(n):
        for j in range(n):
            f[r, j] = chain.phi[i, r, j]
        f[r, n] = chain.drive[i, r]
        h[r] = chain.c[i, r]
    h[n] = chain.direct[i]
    f[n, n] = chain.memory


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
    chain: Chain, error: FloatArray, weight: FloatArray, noise: float, prior: FloatArray, kept: Filtered
) -> float:
    """Return the log-likelihood of an error; keep what the smoother needs where ``kept`` has room."""
    m = prior.shape[0]
    keep = kept.surprises.shape[0] > 0
    f, h, half = np.zeros((m, m)), np.zeros(m), np.zeros((m, m))
    mean, moved, gain = np.zeros(m), np.zeros(m), np.zeros(m)
    covariance = prior.copy()
    likelihood = 0.0
    for b in range(error.shape[0]):
        if b == 0 or chain.phi.shape[0] > 1:
            load(chain, b, f, h)
        if keep:
            kept.means[b] = mean
            kept.covariances[b] = covariance
        if weight[b] > 0.0:
            surprise, precision = observe(error[b], noise / weight[b], h, mean, covariance, gain)
            likelihood -= 0.5 * (np.log(2.0 * np.pi / precision) + surprise * surprise * precision)
            if keep:
                kept.surprises[b] = surprise
                kept.precisions[b] = precision
                kept.gains[b] = gain
        for r in range(m):
            moved[r] = 0.0
            for j in range(m):
                moved[r] += f[r, j] * mean[j]
        mean[:] = moved
        product(f, covariance, half)
        symmetric_product(half, f.T, covariance)
        covariance[m - 1, m - 1] += chain.walk
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
def run_smoother(chain: Chain, kept: Filtered, estimates: FloatArray, variance: FloatArray) -> None:
    """Go back over what the filter kept: fill the estimates, shape (B, m), and the input's variance, shape (B,)."""
    m = kept.means.shape[1]
    f, h, step, half = np.zeros((m, m)), np.zeros(m), np.zeros((m, m)), np.zeros((m, m))
    score, back, information = np.zeros(m), np.zeros(m), np.zeros((m, m))
    for b in range(kept.surprises.shape[0] - 1, -1, -1):
        load(chain, b, f, h)
        precision = kept.precisions[b]
        fill_step(f, kept.gains[b], h, step)
        for r in range(m):
            back[r] = h[r] * kept.surprises[b] * precision
            for j in range(m):
                back[r] += step[j, r] * score[j]
        score[:] = back
        product(information, step, half)
        product(step.T, half, information)
        spread = kept.covariances[b, m - 1, m - 1]
        for r in range(m):
            estimates[b, r] = kept.means[b, r]
            for j in range(m):
                information[r, j] += h[r] * h[j] * precision
                estimates[b, r] += kept.covariances[b, r, j] * score[j]
        for r in range(m):
            for j in range(m):
                spread -= kept.covariances[b, m - 1, r] * information[r, j] * kept.covariances[b, j, m - 1]
        variance[b] = spread


@dataclass(frozen=True, slots=True)
class Input:
    """The input at one place of one recording; arrays of shape (B,), one value per block."""

    value: FloatArray  # estimate and its standard error
    std: FloatArray  # of ``value``
    motion: Motion  # what then happens in the line, in the middle of each block


@dataclass(frozen=True, slots=True)
class Explanation:
    """The inputs at one place, one per recording."""

    place: InputPlace  # where they act
    inputs: tuple[Input, ...]  # in the order of the recordings
    rate: float  # standard deviation of the walk's change in one second [unit of the input]
    log_likelihood: float  # of the error, at the best rate


def explain(result: FitResult, cut: Sequence[BlockedRecording], place: InputPlace, floor: float) -> Explanation:
    """Estimate the input at one place that explains a fit's error."""
    size = size_at(result, place)

    def deficit(exponent: float) -> float:
        rate = size * 10.0**exponent
        nothing = _room(0, cut[0].tangent.scale.size + 1)
        return -sum(_filter(line, place, _chain(line, place, rate), size, floor, nothing) for line in cut)

    best = minimize_scalar(
        deficit,
        bounds=(np.log10(SLOWEST), np.log10(FASTEST)),
        method="bounded",
        options={"xatol": SEARCH_TOLERANCE},
    )
    rate = size * 10.0 ** float(best.x)
    return Explanation(place, tuple(smooth(line, place, rate, size, floor) for line in cut), rate, -float(best.fun))


def explain_all(result: FitResult, cut: Sequence[BlockedRecording], floor: float) -> dict[InputPlace, Explanation]:
    """Estimate the input at every place; the compiled passes hold no interpreter lock and run side by side."""
    wanted = places(result)
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(partial(_explain_at, result, cut, floor), wanted))
    return dict(zip(wanted, found, strict=True))


def _explain_at(result: FitResult, cut: Sequence[BlockedRecording], floor: float, place: InputPlace) -> Explanation:
    return explain(result, cut, place, floor)


def smooth(line: BlockedRecording, place: InputPlace, rate: float, size: float, floor: float) -> Input:
    """Estimate the input at one place of one recording, its walk's rate given."""
    chain = _chain(line, place, rate)
    m = line.tangent.scale.size + 1
    kept, estimates, variance = _room(line.size, m), np.zeros((line.size, m)), np.zeros(line.size)
    _filter(line, place, chain, size, floor, kept)
    run_smoother(chain, kept, estimates, variance)
    later = np.vstack([estimates[1:], estimates[-1:]])
    middle = 0.5 * (estimates + later)
    names = {state_vector.SPEED: "speed", state_vector.TWIST: "twist", state_vector.LOAD_SPEED: "load_speed"}
    moved = {
        names[state]: getattr(line.motion, names[state]) + middle[:, i]
        for i, state in enumerate(line.tangent.states)
        if state in names
    }
    if state_vector.LOAD_SPEED not in line.tangent.states:
        moved["load_speed"] = moved["speed"]
    return Input(estimates[:, -1], np.sqrt(np.maximum(variance, 0.0)), replace(line.motion, **moved))


def _chain(line: BlockedRecording, place: InputPlace, rate: float) -> Chain:
    tangent = line.tangent
    motor, load = FORCES[place]
    direct = tangent.d[:, MOTOR] * motor + tangent.d[:, LOAD] * load + (1.0 if place is InputPlace.SENSOR else 0.0)
    drive = np.ascontiguousarray(tangent.gamma[:, :, MOTOR] * motor + tangent.gamma[:, :, LOAD] * load)
    memory = float(np.exp(-line.period_s / FORGETS_S)) if place is InputPlace.SHAFT else 1.0
    return Chain(tangent.phi, drive, tangent.c, direct, memory, rate**2 * line.period_s)


def _filter(
    line: BlockedRecording, place: InputPlace, chain: Chain, size: float, floor: float, kept: Filtered
) -> float:
    """Run the filter over one recording and return the log-likelihood of its error."""
    states = np.zeros_like(line.tangent.scale) if place is InputPlace.SENSOR else INITIAL_SPREAD * line.tangent.scale
    prior = np.diag(np.append(states, size) ** 2)  # with an error of the reading the line itself is as simulated
    return run_filter(chain, line.error, np.where(line.okay, line.weight, 0.0), floor**2, prior, kept)


def _room(rows: int, m: int) -> Filtered:
    return Filtered(np.zeros((rows, m)), np.zeros((rows, m, m)), np.zeros((rows, m)), np.zeros(rows), np.zeros(rows))
