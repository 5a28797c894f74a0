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

import numpy as np
from scipy.optimize import minimize_scalar

from estimator.diagnosis.line.blocks import Line
from estimator.diagnosis.line.kalman import Chain, Filtered, run_filter, run_smoother
from estimator.diagnosis.line.motion import Motion
from estimator.diagnosis.line.places import FORCES, Place, places, size_at
from estimator.diagnosis.line.tangent import LOAD, MOTOR
from estimator.physics.fit import FitResult
from estimator.physics.kernel import state_vector
from estimator.signals.record import FloatArray

SLOWEST, FASTEST = 1e-3, 1e2
"""Range of the walk's rate, as a share of the torque or speed in use, per root second."""

WIDE = 10.0
"""Before the first sample a state may be off by this many times its size in use; the input by its size in use."""

FORGETS_S = 1.0
"""A shaft torque that stays is invisible: it only holds another twist. Its walk returns to zero in about this time."""

SEARCH_TOLERANCE = 0.15
"""Of the rate's decimal logarithm: the likelihood is flat around its top."""


@dataclass(frozen=True, slots=True)
class Input:
    """The input at one place of one recording; arrays of shape (B,), one value per block.

    Attributes
    ----------
    value, std : ndarray
        Estimate and its standard error: torque that drives the motor, torque the shaft carries beyond its law, torque
        against the load [Nm], or error of the reading [unit of the output].
    motion : Motion
        What then happens in the line, in the middle of each block.
    """

    value: FloatArray
    std: FloatArray
    motion: Motion


@dataclass(frozen=True, slots=True)
class Explanation:
    """The inputs at one place, one per recording.

    Attributes
    ----------
    rate : float
        Standard deviation of the walk's change in one second [unit of the input].
    log_likelihood : float
        Of the error, at the best rate.
    """

    place: Place
    inputs: tuple[Input, ...]
    rate: float
    log_likelihood: float


def explain(result: FitResult, cut: Sequence[Line], place: Place, floor: float) -> Explanation:
    """Estimate the input at one place that explains a fit's error.

    Parameters
    ----------
    cut : sequence of Line
        The fit's recordings in blocks.
    floor : float
        Noise floor of the output.
    """
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


def explain_all(result: FitResult, cut: Sequence[Line], floor: float) -> dict[Place, Explanation]:
    """Estimate the input at every place; the compiled passes hold no interpreter lock and run side by side."""
    wanted = places(result)
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(partial(_explain_at, result, cut, floor), wanted))
    return dict(zip(wanted, found, strict=True))


def _explain_at(result: FitResult, cut: Sequence[Line], floor: float, place: Place) -> Explanation:
    return explain(result, cut, place, floor)


def smooth(line: Line, place: Place, rate: float, size: float, floor: float) -> Input:
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


def _chain(line: Line, place: Place, rate: float) -> Chain:
    tangent = line.tangent
    motor, load = FORCES[place]
    direct = tangent.d[:, MOTOR] * motor + tangent.d[:, LOAD] * load + (1.0 if place is Place.SENSOR else 0.0)
    drive = np.ascontiguousarray(tangent.gamma[:, :, MOTOR] * motor + tangent.gamma[:, :, LOAD] * load)
    memory = float(np.exp(-line.period_s / FORGETS_S)) if place is Place.SHAFT else 1.0
    return Chain(tangent.phi, drive, tangent.c, direct, memory, rate**2 * line.period_s)


def _filter(line: Line, place: Place, chain: Chain, size: float, floor: float, kept: Filtered) -> float:
    """Run the filter over one recording and return the log-likelihood of its error."""
    states = np.zeros_like(line.tangent.scale) if place is Place.SENSOR else WIDE * line.tangent.scale
    prior = np.diag(np.append(states, size) ** 2)  # with an error of the reading the line itself is as simulated
    return run_filter(chain, line.error, np.where(line.okay, line.weight, 0.0), floor**2, prior, kept)


def _room(rows: int, m: int) -> Filtered:
    return Filtered(np.zeros((rows, m)), np.zeros((rows, m, m)), np.zeros((rows, m)), np.zeros(rows), np.zeros(rows))
