"""What moves the output beyond every law: the noise of the readings, a torque reading that drifts, a load that walks.

The free-run error of a hypothesis is the output of the line under these disturbances::

    error = line(torque reading's noise + its drift, load's walk) + coloured + white reading noise

Torque noise is white, and as large as a gap makes it where a torque was not read; its drift and the coloured reading
noise are of first order, the load's walk is a random one. A Kalman filter of this model whitens the error; the model's
sizes and times are estimated with each hypothesis.

Each measured output has disturbances of its own, and the log-likelihoods of all outputs are added up. What they have in
common, a load that walks, then counts once for each: a composite likelihood (Varin, Reid and Firth, Statistica Sinica
21, 2011), whose differences are divided by the number of outputs before anything is believed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from scipy.linalg import expm

from estimator.diagnosis.line.whitening import fill_gains, innovate
from estimator.diagnosis.noise import noise_floor
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.model import Structure
from estimator.physics.motion import torque_scale
from estimator.signals.outputs import by_output
from estimator.signals.record import BoolArray, FloatArray, Location, OutputKind, Record
from estimator.signals.stand_in import stand_in_variance


class Size(IntEnum):
    """Places in the vector of a noise model: natural logarithms of sizes and times."""

    WHITE = 0
    COLOURED = 1
    COLOUR_S = 2
    TORQUE = 3
    DRIFT = 4
    DRIFT_S = 5
    WALK = 6


TORQUE_SHARE, DRIFT_SHARE, WALK_SHARE = 2e-3, 2e-3, 5e-4
"""Usual sizes as shares of the torque in use: a reading of a per mille of the rated torque, its drift, and the change
of the load in a second (a grade of half a per mille, a breath of wind)."""

MOST_TORQUE, MOST_DRIFT, MOST_WALK = 2e-2, 2e-2, 5e-3
"""Sizes beyond which such a disturbance is physics to be named."""

COLOUR_S, DRIFT_S = 0.03, 3.0
"""Usual correlation times of a sensor's coloured noise and of a current sensor's drift [s]."""

PRIOR_SPREAD = 1.5
"""Standard deviation of the logarithm of a size around the usual one: a factor of 20 is two of them."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Usual values of noise models and the bounds they are estimated in, all logarithms; shapes (7 C,) of C outputs."""

    usual: FloatArray
    low: FloatArray
    high: FloatArray

    def freed(self) -> Limits:
        """Return limits for a load that may walk as far as it likes: a road's grade."""
        high = self.high.copy()
        high[Size.WALK :: len(Size)] += np.log(100.0)
        return replace(self, high=high)

    def of(self, output: int) -> Limits:
        """Return those of one output."""
        return Limits(*(sizes_of(each, output) for each in (self.usual, self.low, self.high)))


def sizes_of(sizes: FloatArray, output: int) -> FloatArray:
    """Return the part of a vector of noise models that is one output's, shape (7,)."""
    return sizes[output * len(Size) : (output + 1) * len(Size)]


def reading_noise(sizes: FloatArray) -> FloatArray:
    """Return the noise of each output's reading, white and coloured, shape (C,)."""
    each = np.exp(sizes.reshape(-1, len(Size)))
    noise: FloatArray = np.hypot(each[:, Size.WHITE], each[:, Size.COLOURED])
    return noise


def limits_of(records: Sequence[Record]) -> Limits:
    """Return usual values and bounds of the disturbances of every output of some recordings."""
    each = [limits_for(records[part], noise_floor(records[part])) for part in by_output(records)]
    return Limits(*(np.concatenate([getattr(one, name) for one in each]) for name in ("usual", "low", "high")))


def limits_for(records: Sequence[Record], white: float) -> Limits:
    """Return usual values and bounds for recordings whose output has about so much white noise."""
    torque, period_s = torque_scale(records), records[0].sample_time_s
    in_output = records[0].kind is OutputKind.FORCE
    usual = np.log(
        [white, 0.5 * white, COLOUR_S, TORQUE_SHARE * torque, DRIFT_SHARE * torque, DRIFT_S, WALK_SHARE * torque]
    )
    low, high = usual - np.log(1e3), usual + np.log(1e3)
    low[Size.COLOUR_S], high[Size.COLOUR_S] = np.log([0.5 * period_s, max(0.3, 4.0 * period_s)])
    low[Size.DRIFT_S], high[Size.DRIFT_S] = np.log([max(0.5, 4.0 * period_s), 20.0])
    high[Size.TORQUE] = np.log(MOST_TORQUE * torque)
    high[Size.DRIFT] = np.log(MOST_DRIFT * torque)
    high[Size.WALK] = np.log(MOST_WALK * torque)
    if in_output:  # of an imposed motion nothing is integrated: torque noise is the reading's
        high[[Size.TORQUE, Size.DRIFT]] = usual[[Size.TORQUE, Size.DRIFT]] = low[[Size.TORQUE, Size.DRIFT]]
    return Limits(np.clip(usual, low, high), low, high)


@dataclass(frozen=True, slots=True)
class Line:
    """The linear line as disturbances see it, sampled.

    Attributes
    ----------
    f : ndarray, shape (n, n)
    torque, load : ndarray, shape (n,)
        How a torque held for a sample, at the motor and against the load, moves the state.
    h : ndarray, shape (n,)
    direct : float
        How the load shows in the output at once: 1 for a joint, whose torque is read.
    """

    f: FloatArray
    torque: FloatArray
    load: FloatArray
    h: FloatArray
    direct: float = 0.0


def line_of(result: FitResult, record: Record | None = None) -> Line:
    """Return the linear line with a fit's values, as a recording's output shows it; by default the first one's.

    Effects beyond it do not change how disturbances spread.
    """
    record, structure = record or result.problem.records[0], result.problem.grid.structure
    if structure is Structure.JOINT:
        nothing = np.zeros(0)
        return Line(np.zeros((0, 0)), nothing, nothing, nothing, 1.0)
    values = {name: float(result.p[slot("", name)]) for name in structure.parameter_names}
    a, at_motor, at_load = _continuous(values)
    n = a.shape[0]
    speed = n - 2 if record.location is Location.LOAD else 0  # the angle stands last
    a[n - 1, speed] = 1.0
    h = _seen(record.kind, a, speed, values) / record.unit
    joined = np.zeros((n + 2, n + 2))
    joined[:n, :n], joined[:n, n], joined[:n, n + 1] = a, at_motor, at_load
    moved = expm(joined * record.sample_time_s)
    keep = list(range(n if record.kind is OutputKind.POSITION else n - 1))
    return Line(moved[np.ix_(keep, keep)], moved[keep, n], moved[keep, n + 1], h[keep])


def _seen(kind: OutputKind, a: FloatArray, speed: int, values: Mapping[str, float]) -> FloatArray:
    """Return how the state of a chain shows in an output; what a torque adds to an acceleration at once is left out."""
    h = np.zeros(a.shape[0])
    if kind is OutputKind.TORQUE:
        h[:3] = values["c"], values["k"], -values["c"]
    elif kind is OutputKind.ACCELERATION:
        h[:] = a[speed]
    else:
        h[-1 if kind is OutputKind.POSITION else speed] = 1.0
    return h


def _continuous(values: dict[str, float]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return state matrix and inputs of a chain: speeds and twists in turn, last an angle that nothing drives yet."""
    inertias = [values[name] for name in ("J_M", "J_2", "J_L") if name in values]
    springs = [(values[k], values[c]) for k, c in (("k", "c"), ("k_2", "c_2")) if k in values]
    viscous = [values["b_M"], *[0.0] * (len(inertias) - 2), *([values["b_L"]] if "b_L" in values else [])]
    n = 2 * len(inertias)
    a, at_motor, at_load = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    for i, (inertia, b) in enumerate(zip(inertias, viscous, strict=True)):
        a[2 * i, 2 * i] -= b / inertia
    for i, (k, c) in enumerate(springs):
        left, twist, right = 2 * i, 2 * i + 1, 2 * i + 2
        a[twist, left], a[twist, right] = 1.0, -1.0
        for speed, sign, inertia in ((left, -1.0, inertias[i]), (right, 1.0, inertias[i + 1])):
            a[speed, [twist, left, right]] += sign / inertia * np.array([k, c, -c])
    at_motor[0] = 1.0 / inertias[0]
    at_load[n - 2] = -1.0 / inertias[-1]
    return a, at_motor, at_load


@dataclass(frozen=True, slots=True)
class Whitener:
    """Kalman filters for recordings: a linear map of their errors to innovations of variance 1.

    Attributes
    ----------
    f, h : tuple of ndarray, shapes (m, m) and (m,)
    gains, spread : tuple of ndarray, shapes (N_i, m) and (N_i,)
    use : tuple of ndarray of bool, shape (N_i,)
    """

    f: tuple[FloatArray, ...]
    h: tuple[FloatArray, ...]
    gains: tuple[FloatArray, ...]
    spread: tuple[FloatArray, ...]
    use: tuple[BoolArray, ...]

    def __call__(self, stacked: FloatArray) -> FloatArray:
        """Return the innovations of stacked errors of the samples that count, shape (R,) or (R, K)."""
        columns = np.atleast_2d(stacked.T).T
        ends = np.cumsum([0, *(int(use.sum()) for use in self.use)])
        found = np.empty(columns.shape)
        for i in range(len(self.use)):
            found[ends[i] : ends[i + 1]] = self.part(i, columns[ends[i] : ends[i + 1]])
        return found.reshape(stacked.shape)

    def part(self, index: int, columns: FloatArray) -> FloatArray:
        """Return the same of one recording alone, shape (R_i, K)."""
        use = self.use[index]
        whole = np.zeros((use.size, columns.shape[1]))
        whole[use] = columns
        innovate(self.f[index], self.h[index], self.gains[index], self.spread[index], whole)
        return whole[use]

    def minus_twice_log(self, innovations: FloatArray) -> float:
        """Return minus twice the log-likelihood of stacked innovations, but for a constant."""
        logs = sum(float(np.log(spread[use]).sum()) for spread, use in zip(self.spread, self.use, strict=True))
        return 2.0 * logs + float(innovations @ innovations)


def joined(filters: Sequence[Whitener]) -> Whitener:
    """Return the filters of several outputs as one."""
    names = ("f", "h", "gains", "spread", "use")
    return Whitener(*(tuple(each for one in filters for each in getattr(one, name)) for name in names))


def whitener_of(result: FitResult, sizes: FloatArray) -> Whitener:
    """Return the filters of a fit's errors, a noise model for each output; ``sizes`` of shape (7 C,)."""
    problem = result.problem
    return joined(
        [
            whitener(
                _line_of(result, part),
                sizes_of(sizes, i),
                problem.records[0].sample_time_s,
                problem.use[part],
                _unread(problem.records[part]),
            )
            for i, part in enumerate(by_output(problem.records))
        ]
    )


def _unread(records: Sequence[Record]) -> list[FloatArray]:
    return [stand_in_variance(record) for record in records]


def _line_of(result: FitResult, part: slice) -> Line:
    return line_of(result, result.problem.records[part.start])


def whitener(
    line: Line,
    sizes: FloatArray,
    period_s: float,
    use: Sequence[BoolArray],
    unread: Sequence[FloatArray] | None = None,
) -> Whitener:
    """Return the filter of a noise model, ``sizes`` of shape (7,) as `Size` says.

    ``unread`` is the variance of each recording's torque where it was not read, shapes (N_i,); None: all was read.
    """
    white, coloured, colour_s, torque, drift, drift_s, walk = np.exp(sizes)
    n = line.h.size
    m = n + 3  # drift, walk, coloured
    f, q, prior, h = np.zeros((m, m)), np.zeros((m, m)), np.zeros((m, m)), np.zeros(m)
    kept_drift, kept_colour = np.exp(-period_s / np.array([drift_s, colour_s]))
    f[:n, :n], f[:n, n], f[:n, n + 1] = line.f, line.torque, line.load
    f[n, n], f[n + 1, n + 1], f[n + 2, n + 2] = kept_drift, 1.0, kept_colour
    q[:n, :n] = torque**2 * np.outer(line.torque, line.torque)
    q[n, n], q[n + 1, n + 1] = drift**2 * (1.0 - kept_drift**2), walk**2 * period_s
    q[n + 2, n + 2] = coloured**2 * (1.0 - kept_colour**2)
    prior[n, n], prior[n + 2, n + 2] = drift**2, coloured**2
    h[:n], h[n + 1], h[n + 2] = line.h, line.direct, 1.0
    at_input = np.concatenate([line.torque, np.zeros(3)])
    seen: dict[tuple[bytes, bytes], tuple[FloatArray, FloatArray]] = {}
    each = []
    for mask, variance in zip(use, unread or [np.zeros(mask.size) for mask in use], strict=True):
        key = mask.tobytes(), variance.tobytes()
        if key not in seen:
            seen[key] = np.empty((mask.size, m)), np.empty(mask.size)
            fill_gains(f, h, q, white**2, prior, np.asarray(mask), at_input, variance, *seen[key])
        each.append(seen[key])
    count = len(use)
    return Whitener((f,) * count, (h,) * count, tuple(g for g, _ in each), tuple(s for _, s in each), tuple(use))


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
    """Return the most probable noise model of each output's error, (7 C,), and minus twice the log-posterior of all.

    ``is_anew`` where each is begun from elsewhere, too (``starts``).
    """
    problem, found, whole, first = result.problem, [], 0.0, 0
    for i, part in enumerate(by_output(problem.records)):
        use, mine, bounds = problem.use[part], sizes_of(sizes, i), limits.of(i)
        rows = slice(first, first + sum(int(each.sum()) for each in use))
        line, period_s, first = _line_of(result, part), problem.records[0].sample_time_s, rows.stop
        begun = starts(mine, bounds) if is_anew else [mine]
        unread = _unread(problem.records[part])
        tried = [estimate(line, error[rows], each, bounds, period_s, use, rounds, unread) for each in begun]
        best, value = min(tried, key=lambda each: each[1])
        found.append(best)
        whole += value
    return np.concatenate(found), whole


def estimate(
    line: Line,
    error: FloatArray,
    begun: FloatArray,
    limits: Limits,
    period_s: float,
    use: Sequence[BoolArray],
    rounds: int = 10,
    unread: Sequence[FloatArray] | None = None,
) -> tuple[FloatArray, float]:
    """Return the most probable noise model of an error and its minus twice log-posterior, by Fisher scoring.

    Parameters
    ----------
    error : ndarray, shape (R,)
        Stacked errors of the samples that count.
    begun : ndarray, shape (7,)
        Where the iteration begins.
    unread : sequence of ndarray, shapes (N_i,)
        Variance of the torque where it was not read (`whitener`).
    """

    def at(sizes: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        filtered = whitener(line, sizes, period_s, use, unread)
        innovations = filtered(error)
        logs = np.concatenate(
            [np.log(spread[mask]) for spread, mask in zip(filtered.spread, filtered.use, strict=True)]
        )
        value = 2.0 * float(logs.sum()) + float(innovations @ innovations) + minus_twice_log_prior(sizes, limits)
        return value, innovations, logs

    sizes = np.clip(begun, limits.low, limits.high)
    value, innovations, logs = at(sizes)
    damping = 1e-2
    for _ in range(rounds):
        by_log, by_error = np.empty((sizes.size, error.size)), np.empty((sizes.size, error.size))
        for i in range(sizes.size):
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
            free = ~(((sizes <= limits.low) & (gradient > 0.0)) | ((sizes >= limits.high) & (gradient < 0.0)))
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
