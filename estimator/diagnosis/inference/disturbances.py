"""What moves the output beyond every law: the noise of the readings, a torque reading that drifts, a load that walks.

The free-run error of a hypothesis is the output of the line under these disturbances::

    error = line(torque reading's noise + its drift, load's walk) + coloured + white reading noise

Torque noise is white, and as large as a gap makes it where a torque was not read; its drift and the coloured reading
noise are of first order, the load's walk is a random one. A Kalman filter of this model whitens the error; the model's
sizes and times are estimated with each hypothesis.

Torque and load are the same for every measured output of a recording; each has a reading's noise of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.whitener import READING, Size, Whitener, changes_of, of_first, readings, whitening_of
from estimator.diagnosis.noise import noise_floor
from estimator.physics.fit import FitResult
from estimator.physics.motion import torque_scale
from estimator.physics.work import check_time
from estimator.signals.outputs import by_output
from estimator.signals.record import FloatArray, OutputKind, Record

TORQUE_SHARE, DRIFT_SHARE, WALK_SHARE = 2e-3, 2e-3, 5e-4
"""Usual sizes as shares of the torque in use: a reading of a per mille of the rated torque, its drift, and the change
of the load in a second (a grade of half a per mille, a breath of wind)."""

FORM_SHARE, MOST_FORM = 0.1, 0.5
"""Usual share of a law's change by which its form is off, and the share beyond which it is another law."""

MOST_TORQUE, MOST_DRIFT, MOST_WALK = 2e-2, 2e-2, 5e-3
"""Sizes beyond which such a disturbance is physics to be named."""

COLOUR_S, DRIFT_S = 0.03, 3.0
"""Usual correlation times of a sensor's coloured noise and of a current sensor's drift [s]."""

PRIOR_SPREAD = 1.5
"""Standard deviation of the logarithm of a size around the usual one: a factor of 20 is two of them."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Usual values of a noise model and the bounds it is estimated in, all logarithms, each of shape (S,)."""

    usual: FloatArray
    low: FloatArray
    high: FloatArray

    def freed(self) -> Limits:
        """Return limits for a load that may walk as far as it likes: a road's grade."""
        high = self.high.copy()
        high[Size.WALK] += np.log(100.0)
        return replace(self, high=high)

    def without_forms(self) -> Limits:
        """Return limits that hold the error of laws' forms as usual: of a line without such a law."""
        low, high = self.low.copy(), self.high.copy()
        low[Size.FORM] = high[Size.FORM] = self.usual[Size.FORM]
        return replace(self, low=low, high=high)

    def of_first(self) -> Limits:
        """Return those of the first output alone."""
        return Limits(*(of_first(each) for each in (self.usual, self.low, self.high)))


def reading_noise(sizes: FloatArray) -> FloatArray:
    """Return the noise of each output's reading, white and coloured, shape (C,)."""
    each = np.exp(readings(sizes))
    noise: FloatArray = np.hypot(each[:, Size.WHITE], each[:, Size.COLOURED])
    return noise


def limits_of(records: Sequence[Record]) -> Limits:
    """Return usual values and bounds of the disturbances of every output of some recordings."""
    first, *further = [limits_for(records[part], noise_floor(records[part])) for part in by_output(records)]
    return Limits(
        *(
            np.concatenate([getattr(first, name), *(getattr(each, name)[:READING] for each in further)])
            for name in ("usual", "low", "high")
        )
    )


def limits_for(records: Sequence[Record], white: float) -> Limits:
    """Return usual values and bounds for recordings whose output has about so much white noise."""
    torque, period_s = torque_scale(records), records[0].sample_time_s
    in_output = records[0].kind is OutputKind.FORCE
    usual = np.log(
        [
            white,
            0.5 * white,
            COLOUR_S,
            TORQUE_SHARE * torque,
            DRIFT_SHARE * torque,
            DRIFT_S,
            WALK_SHARE * torque,
            FORM_SHARE,
        ]
    )
    low, high = usual - np.log(1e3), usual + np.log(1e3)
    low[Size.COLOUR_S], high[Size.COLOUR_S] = np.log([0.5 * period_s, max(0.3, 4.0 * period_s)])
    low[Size.DRIFT_S], high[Size.DRIFT_S] = np.log([max(0.5, 4.0 * period_s), 20.0])
    high[Size.FORM] = np.log(MOST_FORM)
    high[Size.TORQUE] = np.log(MOST_TORQUE * torque)
    high[Size.DRIFT] = np.log(MOST_DRIFT * torque)
    high[Size.WALK] = np.log(MOST_WALK * torque)
    if in_output:  # of an imposed motion nothing is integrated: torque noise is the reading's
        high[[Size.TORQUE, Size.DRIFT]] = usual[[Size.TORQUE, Size.DRIFT]] = low[[Size.TORQUE, Size.DRIFT]]
    return Limits(np.clip(usual, low, high), low, high)


STEP = 1e-4
"""Change of a logarithm by which derivatives are found."""

ENOUGH = 0.5
"""Fall of minus twice the log-posterior below which sizes are estimated."""


def minus_twice_log_prior(sizes: FloatArray, limits: Limits) -> float:
    """Return how far a noise model is from the usual one."""
    return float(np.sum(((sizes - limits.usual) / PRIOR_SPREAD) ** 2))


def starts(sizes: FloatArray, limits: Limits) -> list[FloatArray]:
    """Return where else a noise model is begun: a drifting torque and a walking load take each other's place."""
    found = [sizes]
    for large, small in ((Size.WALK, Size.DRIFT), (Size.DRIFT, Size.WALK)):
        other = sizes.copy()
        other[large], other[small] = limits.high[large] - np.log(2.0), sizes[small] - np.log(10.0)
        found.append(np.clip(other, limits.low, limits.high))
    return found


def estimated(
    result: FitResult, error: FloatArray, sizes: FloatArray, limits: Limits, rounds: int, is_anew: bool = False
) -> tuple[FloatArray, float]:
    """Return the most probable noise model of a fit's error and its minus twice log-posterior.

    ``is_anew`` where it is begun from elsewhere, too (``starts``).
    """
    check_time()
    whitened = whitening_of(result)
    limits = limits if changes_of(result) else limits.without_forms()
    begun = starts(sizes, limits) if is_anew else [sizes]
    return min((estimate(whitened, error, each, limits, rounds) for each in begun), key=lambda each: each[1])


def estimate(
    whitened: Callable[[FloatArray], Whitener], error: FloatArray, begun: FloatArray, limits: Limits, rounds: int
) -> tuple[FloatArray, float]:
    """Return the most probable noise model of an error and its minus twice log-posterior, by Fisher scoring.

    Parameters
    ----------
    whitened : callable
        Returns the filter of a noise model.
    error : ndarray, shape (R,)
        Stacked errors of the samples that count.
    begun : ndarray, shape (S,)
        Where the iteration begins.
    """

    def at(sizes: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        filtered = whitened(sizes)
        innovations, logs = filtered(error), filtered.logs
        value = 2.0 * float(logs.sum()) + float(innovations @ innovations) + minus_twice_log_prior(sizes, limits)
        return value, innovations, logs

    sizes = np.clip(begun, limits.low, limits.high)
    value, innovations, logs = at(sizes)
    damping = 1e-2
    for _ in range(rounds):
        by_log, by_error = np.zeros((sizes.size, error.size)), np.zeros((sizes.size, error.size))
        for i in np.flatnonzero(limits.low < limits.high):
            moved = sizes.copy()
            moved[i] += STEP if sizes[i] + STEP <= limits.high[i] else -STEP
            step = moved[i] - sizes[i]
            _, there, their_logs = at(moved)
            by_log[i], by_error[i] = (their_logs - logs) / step, (there - innovations) / step
        # d(innovation / spread) holds both changes: e' = de/s - e dlog s
        pure = by_error + innovations * by_log
        gradient = 2.0 * by_log.sum(axis=1) + 2.0 * by_error @ innovations
        gradient += 2.0 * (sizes - limits.usual) / PRIOR_SPREAD**2
        information = 4.0 * by_log @ by_log.T + 2.0 * pure @ pure.T + 2.0 * np.eye(sizes.size) / PRIOR_SPREAD**2
        promised = 0.0
        while damping < 1e6:
            at_bound = ((sizes <= limits.low) & (gradient > 0.0)) | ((sizes >= limits.high) & (gradient < 0.0))
            free = (limits.low < limits.high) & ~at_bound
            damped = (information + damping * np.diag(np.diag(information)))[np.ix_(free, free)]
            step = np.zeros(sizes.size)
            step[free] = -np.linalg.solve(damped, gradient[free])
            tried = np.clip(sizes + np.clip(step, -2.0, 2.0), limits.low, limits.high)
            moved_value, moved_innovations, moved_logs = at(tried)
            promised = value - moved_value
            if promised > 0.0:
                damping *= 0.2
                sizes, value, innovations, logs = tried, moved_value, moved_innovations, moved_logs
                break
            damping *= 5.0
        if promised < ENOUGH:
            break
    return sizes, value
