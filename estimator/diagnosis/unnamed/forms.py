"""The forms of laws without a name: fixed, free, shares of the inputs, waves, changes and steps.

Order analysis tells which waves over the motor's angle a signal holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from estimator.diagnosis.line.blocks import DRIVES, FORCES, PLACES, BlockedRecording, InputPlace, Motion
from estimator.diagnosis.unnamed.laws import CHANGING, FREE, LAWS, MODULATIONS, Law, hats, knots_of, one, top_of
from estimator.diagnosis.unnamed.scene import Ground, Scene
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.physics.parallel import PARTS, concurrently
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray, IntArray

HIGHEST_ORDER = 24.0  # periods per motor turn: faster ones pass unseen through any driveline
SLOWEST_WAVE = 3.0  # waves that fit into a recording at least
MOST_PEAKS = 3  # orders that are tried of the signal itself, and of its change, the strongest first

SEPARATION = 10.0
"""Orders that differ by less than this many waves in a recording are one: a wave that comes and goes is no line."""

BINS_PER_WAVE = 4.0

LONGEST_TRAVEL = 30_000.0  # angle of one spectrum [rad], some 5000 turns: its grid has a million places
FEWEST_SAMPLES = 1024  # samples in such a piece; with fewer its waves are not seen

STEP_EVERY_S = 0.5  # grid of the moments at which a load torque may step
CHANGE_EVERY_S = 1.0  # grid of the moments at which an inertia, a stiffness or a drag may change
MOST_MOMENTS = 180  # moments in all recordings together; longer ones have a coarser grid
USUAL_ORDERS = (1.0, 2.0)  # waves per motor turn that are tried in any case: imbalance, and joints at an angle
COURSE_KNOTS = 11  # of a slow course of the load over one recording

BATCH = 2**18
"""Values of functions of time that are built and answered at once: enough for compiled code, and no more room."""

MOST_TERMS = 9  # three load steps per recording in a set of three, or as many terms of another kind

MOST_COEFFICIENTS = 45

INDISTINGUISHABLE_SHARE = (
    1e-6  # a candidate that re-tuning reproduces to this share of its power can't be distinguished from it
)
CHUNK = 2048  # rows that are worked on at a time
TOO_ALIKE = 1e-8  # share of a column's power below which it is a combination of others


def peaks(signals: Sequence[FloatArray], angles: Sequence[FloatArray]) -> FloatArray:
    """Return the orders at which signals of recordings have most power over the angle, strongest first."""
    width = 2.0 * np.pi / (BINS_PER_WAVE * HIGHEST_ORDER)
    signals, angles = _pieces(signals, angles)
    if not angles:
        return np.zeros(0)
    travel = max(float(np.ptp(angle)) for angle in angles)
    if travel < 2.0 * np.pi * SLOWEST_WAVE / HIGHEST_ORDER:
        return np.zeros(0)
    size = 1 << int(np.ceil(np.log2(2.0 * travel / width)))
    orders = 2.0 * np.pi * np.arange(size // 2 + 1) / (size * width)
    good = (orders >= 2.0 * np.pi * SLOWEST_WAVE / travel) & (orders <= HIGHEST_ORDER)
    chosen: list[int] = []
    for prepare in (_centred, _differences):
        power = np.zeros(orders.size)
        for signal, angle in zip(signals, angles, strict=True):
            prepared = prepare(signal)
            place = ((angle - angle.min()) / width).astype(int)
            over_angle = np.bincount(place, prepared, size)
            power += np.abs(np.fft.rfft(over_angle)) ** 2 / max(float(prepared @ prepared), np.finfo(float).tiny)
        found, _ = find_peaks(np.where(good, power, 0.0))
        near = SEPARATION * 2.0 * np.pi / travel
        fresh: list[int] = []
        for i in found[np.argsort(-power[found])].tolist():
            if len(fresh) < MOST_PEAKS and all(abs(orders[i] - orders[j]) > near for j in [*chosen, *fresh]):
                fresh.append(i)
        chosen += fresh
    return np.asarray(orders[chosen])


def _pieces(
    signals: Sequence[FloatArray], angles: Sequence[FloatArray]
) -> tuple[Sequence[FloatArray], Sequence[FloatArray]]:
    """Cut recordings that travel further than `LONGEST_TRAVEL`, whose grid over the angle would have no bound.

    Pieces with too few samples for the waves in them are left out: all of them where the angle's unit is wrong.
    """
    if max(float(np.ptp(angle)) for angle in angles) <= LONGEST_TRAVEL:
        return signals, angles
    cut: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for signal, angle in zip(signals, angles, strict=True):
        place = np.floor((angle - angle.min()) / LONGEST_TRAVEL)
        for each in np.unique(place):
            inside = place == each
            if np.count_nonzero(inside) >= FEWEST_SAMPLES:
                cut[0].append(signal[inside])
                cut[1].append(angle[inside])
    return cut


def _centred(signal: FloatArray) -> FloatArray:
    return signal - signal.mean()


def _differences(signal: FloatArray) -> FloatArray:
    """Return a signal's change from sample to sample: a slow drift is no longer the largest part."""
    return np.diff(signal, prepend=signal[0])


Columns = FloatArray
"""One or several functions of time of one recording, shape (B, q)."""

Build = Callable[[Sequence[Motion]], list[Columns]]


@dataclass(frozen=True, slots=True)
class Form:
    """The form of a law without a name: from the motion of each recording to its q functions of time."""

    law: str
    build: Build


def forms(view: Scene, element: Element) -> list[Form]:
    """Return every law without a name that is tried at one element."""
    motions = view.motions(element)
    return [
        *_fixed(element),
        *_free(element, motions),
        *_shares(element, motions),
        *_periodic(view, element, motions),
        *_changes(view.result, element, motions),
        *_steps(view.result, element, motions),
    ]


def _single(law: Law) -> Build:
    return lambda motions: [law(m)[:, np.newaxis] for m in motions]


def _fixed(element: Element) -> list[Form]:
    return [Form(name, _single(law)) for name, law in LAWS[element].items()]


def _free(element: Element, motions: Sequence[Motion]) -> list[Form]:
    found = []
    for name, signal in FREE[element].items():
        knots = knots_of(np.concatenate([signal(m) for m in motions]))
        if knots.size > 2:
            found.append(Form(f"a function of {name}", _function_of(signal, knots)))
    return found


def _function_of(signal: Law, knots: FloatArray) -> Build:
    return lambda motions: [hats(signal(m), knots) for m in motions]


def _shares(element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return that one input counts more than its reading, or is limited by itself; with one input there is no other."""
    inputs = min(m.inputs.shape[1] for m in motions)
    if element is not Element.TORQUE_PATH or inputs == 1:
        return []
    found = [Form(f"T_{j + 1}", _single(partial(_input, j))) for j in range(inputs - 1)]
    for j in range(inputs):
        top = top_of(np.concatenate([_input(j, m) for m in motions]))
        found += [
            Form(f"a part of T_{j + 1} beyond {share:g} of its range", _single(partial(_input_beyond, j, share * top)))
            for share in (0.5, 0.65, 0.8, 0.9)
        ]
    return found


def _input(index: int, motion: Motion) -> FloatArray:
    return motion.inputs[:, index]


def _input_beyond(index: int, limit: float, motion: Motion) -> FloatArray:
    torque = _input(index, motion)
    return torque - np.clip(torque, -limit, limit)


def _periodic(view: Scene, element: Element, motions: Sequence[Motion]) -> list[Form]:
    found = []
    for of, modulation in MODULATIONS[element].items():
        inputs = view.explanations[PLACES[element]].inputs
        weighted = [each.value * modulation(m) for each, m in zip(inputs, motions, strict=True)]
        found += [
            Form(f"a wave{of} {order:.3g} times per motor turn", partial(_waves, order, modulation))
            for order in dict.fromkeys([*USUAL_ORDERS, *peaks(weighted, [m.angle for m in motions])])
        ]
    return found


def _waves(order: float, modulation: Law, motions: Sequence[Motion]) -> list[Columns]:
    """Return cosine and sine of each recording, with coefficients of its own."""
    columns = []
    for i, motion in enumerate(motions):
        wide = np.zeros((motion.angle.size, 2 * len(motions)))
        size = modulation(motion)
        wide[:, 2 * i] = size * np.cos(order * motion.angle)
        wide[:, 2 * i + 1] = size * np.sin(order * motion.angle)
        columns.append(wide)
    return columns


def _changes(result: FitResult, element: Element, motions: Sequence[Motion]) -> list[Form]:
    """Return laws that set in at every moment of a grid, each in one recording alone."""
    names = _names(result)
    return [
        Form(f"{name} from {moment:.1f} s on in {names[i]}", partial(_from_moment, i, law, moment))
        for i, motion in enumerate(motions)
        for name, law in CHANGING[element].items()
        for moment in moments(motion, CHANGE_EVERY_S, len(motions))
    ]


def _steps(result: FitResult, element: Element, motions: Sequence[Motion]) -> list[Form]:
    one_mass = result.problem.grid.structure is Structure.ONE_MASS
    if element is not (Element.MOTOR if one_mass else Element.LOAD):
        return []
    names = _names(result)
    return [
        Form(f"a load step at {moment:.1f} s in {names[i]}", partial(_from_moment, i, one, moment))
        for i, motion in enumerate(motions)
        for moment in moments(motion, STEP_EVERY_S, len(motions))
    ] + [Form(f"a slow course of the load in {name}", partial(_course, i)) for i, name in enumerate(names)]


def _names(result: FitResult) -> list[str]:
    return [record.name for record in result.problem.records]


def _from_moment(index: int, law: Law, moment: float, motions: Sequence[Motion]) -> list[Columns]:
    columns = [np.zeros((m.time_s.size, 1)) for m in motions]
    motion = motions[index]
    columns[index][:, 0] = np.where(motion.time_s >= moment, law(motion), 0.0)
    return columns


def _course(index: int, motions: Sequence[Motion]) -> list[Columns]:
    """Return a piecewise linear function of the time of one recording."""
    time_s = motions[index].time_s
    knots = np.linspace(time_s[0], time_s[-1], COURSE_KNOTS)
    columns = [np.zeros((m.time_s.size, COURSE_KNOTS)) for m in motions]
    columns[index] = hats(time_s, knots)
    return columns


def moments(motion: Motion, every_s: float, recordings: int) -> FloatArray:
    """Return the moments of one of so many recordings at which something may set in [s]."""
    length_s = float(motion.time_s[-1] - motion.time_s[0])
    every_s = max(every_s, recordings * length_s / MOST_MOMENTS)
    return motion.time_s[0] + every_s * np.arange(1, max(int(length_s / every_s), 2))


@dataclass(frozen=True, slots=True)
class Pool:
    """Laws without a name at one element: functions with a coefficient each, and the output's answers to them."""

    laws: tuple[str, ...]  # the laws, as text
    group: IntArray  # (width,): to which law each function belongs, in order
    answers: FloatArray

    def of(self, laws: Sequence[int]) -> FloatArray:
        rows = [np.flatnonzero(self.group == law) for law in laws]
        return self.answers[np.concatenate([np.zeros(0, dtype=int), *rows])].T


def candidates(view: Scene, element: Element, tried: Sequence[Form] | None = None) -> Pool:
    """Return laws without a name at one element, all by default, with the output's answers to them."""
    tried = forms(view, element) if tried is None else tried
    motions = view.motions(element)
    widths, parts, some = [], list[FloatArray](), list[Sequence[Columns]]()
    room = BATCH
    for form in tried:
        some.append(form.build(motions))
        widths.append(some[-1][0].shape[1])
        room -= sum(columns.size for columns in some[-1])
        if room <= 0:
            parts.append(answers(view, element, some))
            some, room = [], BATCH
    parts.append(answers(view, element, some))
    return Pool(tuple(form.law for form in tried), np.repeat(np.arange(len(widths)), widths), np.vstack(parts))


def answers(view: Scene, element: Element, laws: Sequence[Sequence[Columns]]) -> FloatArray:
    """Return the output's answers to functions of time at an element, shape (width, rows), blocks in use only.

    ``laws`` are any number of laws: of each its functions of time in every recording.
    """
    if not laws:
        return np.zeros((0, sum(int(line.rows.sum()) for line in view.cut)))

    def part(i: int) -> FloatArray:
        functions = np.concatenate([columns[i].T for columns in laws])
        return view.rows(i, _answers_of(view.cut[i], element, functions).T).T

    return np.hstack(concurrently(part, range(len(view.cut))))


def _answers_of(line: BlockedRecording, element: Element, functions: FloatArray) -> FloatArray:
    """Return the output's answers to functions of time in one recording, a row each."""
    if PLACES[element] is InputPlace.SENSOR:
        return functions
    motor, load = FORCES[PLACES[element]]
    sign = DRIVES[element]
    return line.tangent.answers(sign * motor, sign * load, functions)


Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Path:
    """A pursuit."""

    squares: list[float]
    coefficients: list[int]
    chosen: list[int]  # groups, in order
    columns: FloatArray  # their answers, and what re-tuning leaves of these
    rest: FloatArray
    term: Indices  # (q,): which choice, from 0, each column belongs to
    alone: FloatArray  # (groups,): how much of the error's power each group explains by itself
    error: FloatArray  # (rows,): what re-tuning leaves of the error
    triangle: FloatArray
    target: FloatArray  # (q,): factors of ``rest``, and the error along its orthonormal basis

    def solved(self, terms: int, ridge: float) -> tuple[FloatArray, FloatArray]:
        coefficients = self.weighed(terms, ridge)
        return coefficients, self.error - self.rest[:, : coefficients.size] @ coefficients

    def weighed(self, terms: int, ridge: float) -> FloatArray:
        """Return the coefficients of the first terms."""
        q = int(np.count_nonzero(self.term < terms))
        if q == 0:
            return np.zeros(0)
        return np.linalg.lstsq(self.triangle[:q, :q], self.target[:q], rcond=ridge)[0].astype(np.float64)


def pursue(pool: Pool, ground: Ground) -> Path:
    """Choose groups of candidates while they are worth their coefficients."""
    group, count = pool.group, len(pool.laws)
    scale, full, full_match = _products(pool, ground)
    gram, match = full, full_match
    squares, counts, chosen = [float(ground.error @ ground.error)], [0], list[int]()
    alone, _ = _gains(gram, match, group, count)
    left = ground.error
    for _ in range(MOST_TERMS):
        n = effective_samples(ground.split(left))
        gains, ranks = _gains(gram, match, group, count)
        gains[chosen] = 0.0
        remaining = np.maximum(squares[-1] - gains, np.finfo(float).tiny * max(squares[0], 1.0))
        worth = np.where(gains > 0.0, n * np.log(squares[-1] / remaining) - ranks * math.log(n), -np.inf)
        best = int(worth.argmax())
        if worth[best] <= 0.0 or counts[-1] + ranks[best] > MOST_COEFFICIENTS:
            break
        members = np.flatnonzero(np.isin(group, [*chosen, best]))
        weights = np.linalg.lstsq(full[np.ix_(members, members)], full_match[members], rcond=TOO_ALIKE)[0]
        left = ground.error - ground.rest((scale[members] * weights) @ pool.answers[members])
        after = float(left @ left)  # what the sweeps promise is off by all their rounding
        if n * math.log(squares[-1] / after) <= ranks[best] * math.log(n):
            break
        chosen.append(best)
        squares.append(after)
        counts.append(counts[-1] + int(ranks[best]))
        gram, match = _swept(gram, match, np.flatnonzero(group == best))
    columns = pool.of(chosen)
    term = np.repeat(np.arange(len(chosen)), [int(np.count_nonzero(group == each)) for each in chosen])
    rest = ground.rest(columns)
    return Path(squares, counts, chosen, columns, rest, term, alone, ground.error, *factored(rest, ground.error))


def factored(columns: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    q = columns.shape[1]
    triangle = np.asarray(np.linalg.qr(np.column_stack([columns, target]), mode="r"))
    return triangle[:q, :q], np.ascontiguousarray(triangle[:q, q])


def _products(pool: Pool, ground: Ground) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the scales that make what re-tuning leaves of the answers of unit norm, its Gram matrix and its match.

    Rows are taken in chunks: the answers of a long recording fill the memory once, and not once more for what is left.
    """
    seen = pool.answers @ ground.basis
    shares = np.array_split(np.arange(0, ground.error.size, CHUNK), PARTS)
    parts = concurrently(lambda firsts: _summed(pool, ground, seen, firsts), shares)
    before, gram, match = (np.sum(each, axis=0) for each in zip(*parts, strict=True))
    after = np.diag(gram)
    alive = after > INDISTINGUISHABLE_SHARE * np.maximum(before, np.finfo(float).tiny)
    scale = np.where(alive, 1.0 / np.sqrt(np.where(alive, after, 1.0)), 0.0)
    return scale, gram * np.outer(scale, scale), match * scale


def _summed(
    pool: Pool, ground: Ground, seen: FloatArray, firsts: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the power of the answers, and the Gram matrix and the match of what is left of them, over some chunks."""
    width = pool.group.size
    before, gram, match = np.zeros(width), np.zeros((width, width)), np.zeros(width)
    for first in firsts.tolist():
        rows = slice(first, first + CHUNK)
        raw = pool.answers[:, rows]
        rest = raw - seen @ ground.basis[rows].T
        before += np.einsum("ij,ij->i", raw, raw)
        gram += rest @ rest.T
        match += rest @ ground.error[rows]
    return before, gram, match


def _gains(gram: FloatArray, match: FloatArray, group: Indices, count: int) -> tuple[FloatArray, FloatArray]:
    """Return how much of the error's power each group takes, and how many coefficients it has."""
    power = np.diag(gram)
    good = power > TOO_ALIKE
    single = np.where(good, match**2 / np.where(good, power, 1.0), 0.0)
    gains = np.bincount(group, single, count).astype(np.float64)
    ranks = np.bincount(group, good.astype(np.float64), count).astype(np.float64)
    for each in np.flatnonzero(np.bincount(group, minlength=count) > 1):
        rows = np.flatnonzero(group == each)
        values, vectors = np.linalg.eigh(gram[np.ix_(rows, rows)])
        kept = values > TOO_ALIKE
        projected = vectors[:, kept].T @ match[rows]
        gains[each] = float(np.sum(projected**2 / values[kept]))
        ranks[each] = int(kept.sum())
    return gains, ranks


def _swept(gram: FloatArray, match: FloatArray, rows: Indices) -> tuple[FloatArray, FloatArray]:
    """Take chosen columns out of all others."""
    inverse = np.linalg.pinv(gram[np.ix_(rows, rows)], rcond=TOO_ALIKE, hermitian=True)
    weights = gram[:, rows] @ inverse
    return gram - weights @ gram[rows], match - weights @ match[rows]
