"""Disturbances of torque, load and reading, and the Kalman filter that whitens their error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from estimator.diagnosis.line.line import LASTS, FormPlace, LinearLine, changes_of, line_of
from estimator.diagnosis.line.whitening import (
    Gains,
    StateSpace,
    Terms,
    beginnings,
    fill_gains,
    innovate,
    innovations_of,
    terms_of,
)
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.priors import DisturbancePriors
from estimator.diagnosis.thresholds import Fitting
from estimator.lanes import LANES
from estimator.physics.fit import FitResult
from estimator.physics.motion import torque_scale
from estimator.physics.parallel import check_time
from estimator.physics.problem import Rows
from estimator.signals.correlation import stand_in_variance
from estimator.signals.record import BoolArray, FloatArray, OutputKind, Record, by_output

READING = 3  # how many sizes are of an output's reading

STEP = 1e-4  # change of a logarithm by which derivatives are found

DAMPINGS = 5.0 ** np.arange(LANES)  # by what the damping of a scoring step is multiplied, of steps tried at once


class Size(IntEnum):
    """Places in the vector of a noise model: natural logarithms of sizes and times.

    The noise of each further output's reading follows: its ``WHITE``, ``COLOURED`` and ``COLOUR_S``.
    """

    WHITE = 0
    COLOURED = 1
    COLOUR_S = 2
    TORQUE = 3
    DRIFT = 4
    DRIFT_S = 5
    WALK = 6
    FORM = 7


def readings(sizes: FloatArray) -> FloatArray:
    """Return the sizes of each output's reading, shape (..., C, 3), of noise models (..., S) of C outputs."""
    both = np.concatenate([sizes[..., :READING], sizes[..., len(Size) :]], axis=-1)
    return both.reshape(*sizes.shape[:-1], -1, READING)


@dataclass(frozen=True, slots=True)
class Whitener:
    """Kalman filters for recordings: a linear map of their errors to innovations of variance 1."""

    f: Terms  # transition of the state, (m, m)
    h: Terms  # how each output shows the state, (C, m)
    gains: tuple[Gains, ...]  # of each recording
    use: tuple[BoolArray, ...]  # (N_i, C)
    rows: tuple[Rows, ...]  # where the samples of each recording stand when stacked

    def __call__(self, stacked: FloatArray) -> FloatArray:
        """Return the innovations of stacked errors of the samples that count, shape (R,) or (R, K)."""
        columns = np.atleast_2d(stacked.T).T
        found = np.empty(columns.shape)
        for i, rows in enumerate(self.rows):
            found[rows] = self.part(i, columns[rows])
        return found.reshape(stacked.shape)

    def part(self, index: int, columns: FloatArray) -> FloatArray:
        """Return the same of one recording alone, shape (R_i, K)."""
        found, use, gains = np.array(columns, order="C"), self.use[index], self.gains[index]
        room = tuple(np.zeros((each, found.shape[1])) for each in (*2 * gains.predictor.shape[2:], use.shape[1]))
        innovate(self.f, self.h, gains, use, found, beginnings(use), room)
        return found

    @property
    def logs(self) -> FloatArray:
        """Logarithms of the innovations' standard deviations, stacked, shape (R,)."""
        found = np.empty(sum(int(use.sum()) for use in self.use))
        for rows, gains, use in zip(self.rows, self.gains, self.use, strict=True):
            found[rows] = np.log(gains.spread.T[use.T])
        return found


class Innovations(NamedTuple):
    """The innovations of an error under each of L noise models, and the logarithms of their standard deviations."""

    values: FloatArray  # (L, R)
    logs: FloatArray  # (L, R)

    @property
    def minus_twice_log(self) -> FloatArray:
        """Minus twice the log likelihood of each noise model, shape (L,), but for its constant."""
        return 2.0 * self.logs.sum(axis=1) + np.sum(self.values**2, axis=1)


@dataclass(frozen=True, slots=True)
class Whitening:
    """What the filters of some recordings depend on besides the noise model."""

    line: LinearLine  # how torque and load spread
    period_s: float  # between samples [s]
    use: Sequence[BoolArray]  # (N_i, C): which outputs were read
    unread: Sequence[FloatArray]  # (N_i,): variance of the torque where it was not read
    rows: Sequence[Rows]  # where the samples of each recording stand when stacked
    changes: Sequence[FloatArray] = ()  # (3, N_i): by how much laws change at each place; nothing where none does

    @property
    def off(self) -> list[FormPlace]:
        """The places at which laws are off by their forms."""
        return [place for place in FormPlace if any(change[place].any() for change in self.changes)]

    def filters(self, sizes: FloatArray) -> Whitener:
        """Return the filters of the recordings under a noise model, ``sizes`` as `Size` says."""
        model = self._model(sizes[np.newaxis]).at(0)
        seen: dict[tuple[bytes, bytes], Gains] = {}
        each = []
        for i, mask in enumerate(self.use):
            unread = self._unread(i)
            key = mask.tobytes(), unread.tobytes()
            if key not in seen:
                count, m = mask.shape[1], model.at_input.shape[1]
                seen[key] = Gains(np.empty((*mask.shape, m)), np.empty((*mask.shape, count)), np.empty(mask.shape))
                room = (np.empty(m * m), np.empty((count, m)), np.empty((count, m)), np.zeros(m), np.empty(count))
                fill_gains(model, mask, unread, seen[key], model.prior.copy(), room)
            each.append(seen[key])
        return Whitener(model.f, model.h, tuple(each), tuple(self.use), tuple(self.rows))

    def innovations(self, error: FloatArray, sizes: FloatArray) -> Innovations:
        """Return the innovations of a stacked error, shape (R,), under noise models, shape (L, S)."""
        found = Innovations(*np.empty((2, len(sizes), error.size)))
        for first in range(0, len(sizes), LANES):
            some = slice(first, first + LANES)
            count = sizes[some].shape[0]
            model = self._model(np.resize(sizes[some], (LANES, sizes.shape[1])))
            for i, (mask, rows) in enumerate(zip(self.use, self.rows, strict=True)):
                values, variances = innovations_of(model, mask, self._unread(i), error[rows])
                found.values[some, rows] = (values / np.sqrt(variances)).T[:count]
                found.logs[some, rows] = 0.5 * np.log(variances).T[:count]
        return found

    def _unread(self, index: int) -> FloatArray:
        """Return the variance of each input that a recording does not tell, before its share, shape (N, n)."""
        off = self.off
        changes = [(1.0 - np.exp(-2.0 / LASTS)) * self.changes[index][place] ** 2 for place in off]
        return np.column_stack([self.unread[index], *changes])

    def _model(self, sizes: FloatArray) -> StateSpace:
        """Return the model of the errors under L noise models, shape (L, S)."""
        line, off, period_s = self.line, self.off, self.period_s
        torque, drift, drift_s, walk, share = np.exp(sizes[:, READING : len(Size)]).T
        white, coloured, colour_s = np.exp(readings(sizes).transpose(2, 1, 0).copy())
        count, n = line.h.shape
        m = n + 2 + count + len(off)  # drift, walk, coloured of each output, laws off by their forms
        drifting, walking, colours = n, n + 1, n + 2 + np.arange(count)
        forms = n + 2 + count + np.arange(len(off))
        f, q, prior = np.zeros((3, m, m, len(sizes)))
        h, at_input = np.zeros((count, m)), np.zeros((1 + len(off), m))
        kept_drift, kept_colour = np.exp(-period_s / drift_s), np.exp(-period_s / colour_s)
        f[:n, :n], f[:n, drifting], f[:n, walking] = (each[..., None] for each in (line.f, line.torque, line.load))
        f[drifting, drifting], f[walking, walking], f[colours, colours] = kept_drift, 1.0, kept_colour
        f[forms, forms] = np.exp(-1.0 / LASTS)
        for place, state in zip(off, forms, strict=True):
            f[:n, state] = (line.torque, line.load, line.shaft)[place][:, None]
        q[:n, :n] = torque**2 * np.outer(line.torque, line.torque)[..., None]
        q[drifting, drifting], q[walking, walking] = drift**2 * (1.0 - kept_drift**2), walk**2 * period_s
        q[colours, colours] = coloured**2 * (1.0 - kept_colour**2)
        prior[drifting, drifting], prior[colours, colours] = drift**2, coloured**2
        h[:, :n], h[:, walking], h[np.arange(count), colours] = line.h, line.direct, 1.0
        at_input[0, :n], at_input[1:, forms] = line.torque, np.eye(len(off))
        shares = np.vstack([np.ones(len(sizes)), np.tile(share**2, (len(off), 1))])
        flat = [each.reshape(m * m, len(sizes)) for each in (q, prior)]
        return StateSpace(terms_of(f), terms_of(h), flat[0], white**2, flat[1], at_input, shares)


def whitener_of(result: FitResult, sizes: FloatArray) -> Whitener:
    """Return the filters of a fit's errors under a noise model, ``sizes`` as `Size` says."""
    return whitening_of(result).filters(sizes)


def whitening_of(result: FitResult) -> Whitening:
    """Return what turns noise models into the filters of a fit's errors."""
    problem = result.problem
    parts, firsts = by_output(problem.records), problem.records[: len(problem.bases)]
    use = [np.zeros((record.time_s.size, len(parts)), dtype=np.bool_) for record in firsts]
    for output, part in enumerate(parts):
        for i in range(part.start, part.stop):
            use[problem.leads[i]][:, output] = problem.use[i]
    unread = [stand_in_variance(record) for record in firsts]
    return Whitening(line_of(result), firsts[0].sample_time_s, use, unread, problem.rows, changes_of(result))


@dataclass(frozen=True, slots=True)
class Limits:
    """Usual values of a noise model and the bounds it is estimated in, all logarithms, each of shape (S,)."""

    usual: FloatArray  # mode of the prior
    low: FloatArray  # lower bounds
    high: FloatArray  # upper bounds

    def freed(self) -> Limits:
        """Return limits for a load that may walk as far as it likes: a road's grade."""
        high = self.high.copy()
        high[Size.WALK] += np.log(100.0)
        return replace(self, high=high)

    def without_forms(self) -> Limits:
        """Return limits for laws whose form is not in error: that part of the noise keeps its usual size."""
        low, high = self.low.copy(), self.high.copy()
        low[Size.FORM] = high[Size.FORM] = self.usual[Size.FORM]
        return replace(self, low=low, high=high)


def reading_noise(sizes: FloatArray) -> FloatArray:
    """Return the standard deviation of each output's noise, white and coloured [unit of the output]; shape (C,)."""
    each = np.exp(readings(sizes))
    return np.hypot(each[:, Size.WHITE], each[:, Size.COLOURED])


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
            DisturbancePriors.COLOUR_S,
            DisturbancePriors.TORQUE_SHARE * torque,
            DisturbancePriors.DRIFT_SHARE * torque,
            DisturbancePriors.DRIFT_S,
            DisturbancePriors.WALK_SHARE * torque,
            DisturbancePriors.FORM_SHARE,
        ]
    )
    low, high = usual - np.log(DisturbancePriors.FACTOR), usual + np.log(DisturbancePriors.FACTOR)
    few_periods_s = DisturbancePriors.FEW_PERIODS * period_s
    low[Size.COLOUR_S], high[Size.COLOUR_S] = np.log(
        [0.5 * period_s, max(DisturbancePriors.MOST_COLOUR_S, few_periods_s)]
    )
    low[Size.DRIFT_S], high[Size.DRIFT_S] = np.log(
        [max(DisturbancePriors.LEAST_DRIFT_S, few_periods_s), DisturbancePriors.MOST_DRIFT_S]
    )
    high[Size.FORM] = np.log(DisturbancePriors.MOST_FORM)
    high[Size.TORQUE] = np.log(DisturbancePriors.MOST_TORQUE * torque)
    high[Size.DRIFT] = np.log(DisturbancePriors.MOST_DRIFT * torque)
    high[Size.WALK] = np.log(DisturbancePriors.MOST_WALK * torque)
    if in_output:  # of an imposed motion nothing is integrated: torque noise is the reading's
        high[[Size.TORQUE, Size.DRIFT]] = usual[[Size.TORQUE, Size.DRIFT]] = low[[Size.TORQUE, Size.DRIFT]]
    return Limits(np.clip(usual, low, high), low, high)


def minus_twice_log_prior(sizes: FloatArray, limits: Limits) -> FloatArray:
    """Return how far each of L noise models, shape (L, S), is from the usual one, shape (L,)."""
    found: FloatArray = np.sum(((sizes - limits.usual) / DisturbancePriors.PRIOR_SPREAD) ** 2, axis=1)
    return found


def starts(sizes: FloatArray, limits: Limits) -> list[FloatArray]:
    """Return where else a noise model starts: a drifting torque and a walking load take each other's place."""
    found = [sizes]
    for large, small in ((Size.WALK, Size.DRIFT), (Size.DRIFT, Size.WALK)):
        other = sizes.copy()
        other[large], other[small] = limits.high[large] - np.log(2.0), sizes[small] - np.log(10.0)
        found.append(np.clip(other, limits.low, limits.high))
    return found


def estimated(
    result: FitResult, error: FloatArray, sizes: FloatArray, limits: Limits, rounds: int, is_anew: bool = False
) -> tuple[FloatArray, float]:
    """Return the most probable noise model of a fit's error and its minus twice log-posterior."""
    check_time()
    whitening = whitening_of(result)
    limits = limits if whitening.changes else limits.without_forms()
    initial = starts(sizes, limits) if is_anew else [sizes]
    return min((estimate(whitening, error, each, limits, rounds) for each in initial), key=lambda each: each[1])


def estimate(
    whitening: Whitening, error: FloatArray, initial: FloatArray, limits: Limits, rounds: int
) -> tuple[FloatArray, float]:
    """Return the most probable noise model of an error and its minus twice log-posterior, by Fisher scoring.

    The derivatives by all sizes, and steps of all dampings, take a filter each; these run side by side. Of the steps
    that gain the least damped is taken: the one that gains most takes what a law has yet to explain for noise.
    """

    def at(sizes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        found = whitening.innovations(error, sizes)
        return found.minus_twice_log + minus_twice_log_prior(sizes, limits), found.values, found.logs

    sizes = np.clip(initial, limits.low, limits.high)
    value, innovations, logs = (each[0] for each in at(sizes[np.newaxis]))
    moving, damping = limits.low < limits.high, 1e-2
    for _ in range(rounds):
        steps = np.where(sizes + STEP <= limits.high, STEP, -STEP)
        _, there, their_logs = at(sizes + np.diag(steps)[moving])
        by_log, by_error = np.zeros((2, sizes.size, error.size))
        by_log[moving] = (their_logs - logs) / steps[moving, np.newaxis]
        by_error[moving] = (there - innovations) / steps[moving, np.newaxis]
        # d(innovation / spread) holds both changes: e' = de/s - e dlog s
        pure = by_error + innovations * by_log
        gradient = 2.0 * by_log.sum(axis=1) + 2.0 * by_error @ innovations
        gradient += 2.0 * (sizes - limits.usual) / DisturbancePriors.PRIOR_SPREAD**2
        information = (
            4.0 * by_log @ by_log.T + 2.0 * pure @ pure.T + 2.0 * np.eye(sizes.size) / DisturbancePriors.PRIOR_SPREAD**2
        )
        at_bound = ((sizes <= limits.low) & (gradient > 0.0)) | ((sizes >= limits.high) & (gradient < 0.0))
        free = moving & ~at_bound
        tried = np.tile(sizes, (LANES, 1))
        for each, factor in zip(tried, DAMPINGS, strict=True):
            damped = (information + damping * factor * np.diag(np.diag(information)))[np.ix_(free, free)]
            each[free] -= np.clip(np.linalg.solve(damped, gradient[free]), -2.0, 2.0)
        tried = np.clip(tried, limits.low, limits.high)
        values, there, their_logs = at(tried)
        gained = value - values
        if not (gained > 0.0).any():
            break
        least = int(
            np.argmax(gained > 0.0)
        )  # of the steps that gain the least damped, and not the one that gains most:
        damping *= 0.2 * DAMPINGS[least]  # that one takes what a law has yet to explain for noise
        sizes, value, innovations, logs = tried[least], values[least], there[least], their_logs[least]
        if gained[least] < Fitting.ENOUGH:
            break
    return sizes, float(value)
