"""Disturbances of torque, load and reading, and the Kalman filter that whitens their error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial

import numpy as np

from estimator.diagnosis.line.line import LASTS, FormPlace, LinearLine, changes_of, line_of
from estimator.diagnosis.line.whitening import Gains, Terms, fill_gains, innovate, terms_of
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.priors import DisturbancePriors
from estimator.diagnosis.thresholds import Fitting
from estimator.physics.fit import FitResult
from estimator.physics.motion import torque_scale
from estimator.physics.parallel import check_time
from estimator.physics.problem import Rows
from estimator.signals.correlation import stand_in_variance
from estimator.signals.record import BoolArray, FloatArray, OutputKind, Record, by_output

READING = 3  # how many sizes are of an output's reading

STEP = 1e-4  # change of a logarithm by which derivatives are found


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
    """Return the sizes of each output's reading, shape (C, 3), of a noise model of C outputs."""
    return np.concatenate([sizes[:READING], sizes[len(Size) :]]).reshape(-1, READING)


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
        found = np.array(columns, order="C")
        innovate(self.f, self.h, self.gains[index], self.use[index], found)
        return found

    @property
    def logs(self) -> FloatArray:
        """Logarithms of the innovations' standard deviations, stacked, shape (R,)."""
        found = np.empty(sum(int(use.sum()) for use in self.use))
        for rows, gains, use in zip(self.rows, self.gains, self.use, strict=True):
            found[rows] = np.log(gains.spread.T[use.T])
        return found

    def minus_twice_log(self, innovations: FloatArray) -> float:
        """Return minus twice the log likelihood of stacked innovations, shape (R,), but for its constant."""
        return 2.0 * float(self.logs.sum()) + float(innovations @ innovations)


def whitener_of(result: FitResult, sizes: FloatArray) -> Whitener:
    """Return the filters of a fit's errors under a noise model, ``sizes`` as `Size` says."""
    return whitening_of(result)(sizes)


def whitening_of(result: FitResult) -> Callable[[FloatArray], Whitener]:
    """Return a function from a noise model to the filters of a fit's errors."""
    problem = result.problem
    parts, firsts = by_output(problem.records), problem.records[: len(problem.bases)]
    use = [np.zeros((record.time_s.size, len(parts)), dtype=np.bool_) for record in firsts]
    for output, part in enumerate(parts):
        for i in range(part.start, part.stop):
            use[problem.leads[i]][:, output] = problem.use[i]
    line, changes = line_of(result), changes_of(result)
    unread = [stand_in_variance(record) for record in firsts]
    return partial(whitener, line, firsts[0].sample_time_s, use, unread, problem.rows, changes=changes)


def whitener(
    line: LinearLine,
    period_s: float,
    use: Sequence[BoolArray],
    unread: Sequence[FloatArray],
    rows: Sequence[Rows],
    sizes: FloatArray,
    changes: Sequence[FloatArray] = (),
) -> Whitener:
    """Return the filters of recordings under a noise model, ``sizes`` as `Size` says."""
    torque, drift, drift_s, walk, share = np.exp(sizes[READING : len(Size)])
    white, coloured, colour_s = np.exp(readings(sizes)).T
    count, n = line.h.shape
    off = [place for place in FormPlace if any(change[place].any() for change in changes)]
    m = n + 2 + count + len(off)  # drift, walk, coloured of each output, laws off by their forms
    forms = n + 2 + count + np.arange(len(off))
    colours = n + 2 + np.arange(count)
    f, q, prior, h = np.zeros((m, m)), np.zeros((m, m)), np.zeros((m, m)), np.zeros((count, m))
    kept_drift, kept_colour = np.exp(-period_s / drift_s), np.exp(-period_s / colour_s)
    f[:n, :n], f[:n, n], f[:n, n + 1] = line.f, line.torque, line.load
    f[n, n], f[n + 1, n + 1], f[colours, colours] = kept_drift, 1.0, kept_colour
    q[:n, :n] = torque**2 * np.outer(line.torque, line.torque)
    q[n, n], q[n + 1, n + 1] = drift**2 * (1.0 - kept_drift**2), walk**2 * period_s
    q[colours, colours] = coloured**2 * (1.0 - kept_colour**2)
    prior[n, n], prior[colours, colours] = drift**2, coloured**2
    h[:, :n], h[:, n + 1], h[np.arange(count), colours] = line.h, line.direct, 1.0
    at_input = np.zeros((1 + len(off), m))
    at_input[0, :n], at_input[1:, forms] = line.torque, np.eye(len(off))
    kept_form = np.exp(-1.0 / LASTS)
    f[forms, forms] = kept_form
    for place, state in zip(off, forms, strict=True):
        f[:n, state] = (line.torque, line.load, line.shaft)[place]
    terms = terms_of(f)
    seen: dict[tuple[bytes, bytes], Gains] = {}
    each = []
    for i, (mask, own) in enumerate(zip(use, unread, strict=True)):
        of_forms = [(1.0 - kept_form**2) * (share * changes[i][place]) ** 2 for place in off]
        variance = np.column_stack([own, *of_forms])
        key = mask.tobytes(), variance.tobytes()
        if key not in seen:
            seen[key] = Gains(np.empty((*mask.shape, m)), np.empty((*mask.shape, count)), np.empty(mask.shape))
            fill_gains(terms, h, q, white**2, prior, mask, at_input, variance, seen[key])
        each.append(seen[key])
    return Whitener(terms, terms_of(h), tuple(each), tuple(use), tuple(rows))


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


def minus_twice_log_prior(sizes: FloatArray, limits: Limits) -> float:
    """Return how far a noise model is from the usual one."""
    return float(np.sum(((sizes - limits.usual) / DisturbancePriors.PRIOR_SPREAD) ** 2))


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
    whitened = whitening_of(result)
    limits = limits if changes_of(result) else limits.without_forms()
    initial = starts(sizes, limits) if is_anew else [sizes]
    return min((estimate(whitened, error, each, limits, rounds) for each in initial), key=lambda each: each[1])


def estimate(
    whitened: Callable[[FloatArray], Whitener], error: FloatArray, initial: FloatArray, limits: Limits, rounds: int
) -> tuple[FloatArray, float]:
    """Return the most probable noise model of an error and its minus twice log-posterior, by Fisher scoring."""

    def at(sizes: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        filtered = whitened(sizes)
        innovations, logs = filtered(error), filtered.logs
        value = 2.0 * float(logs.sum()) + float(innovations @ innovations) + minus_twice_log_prior(sizes, limits)
        return value, innovations, logs

    sizes = np.clip(initial, limits.low, limits.high)
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
        gradient += 2.0 * (sizes - limits.usual) / DisturbancePriors.PRIOR_SPREAD**2
        information = (
            4.0 * by_log @ by_log.T + 2.0 * pure @ pure.T + 2.0 * np.eye(sizes.size) / DisturbancePriors.PRIOR_SPREAD**2
        )
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
        if promised < Fitting.ENOUGH:
            break
    return sizes, value
