"""Candidates for a law without a name, and orthogonal matching pursuit over groups of them.

A law acts as a torque at motor, shaft or load, in the torque path, or as an error of the reading. Each is a function of
the motion that goes with an unknown input at its own place (``line.equivalent``), so that it is taken at
the speed and the twist that were there and not at those of a simulation that lacks it. The answer of the output to it
is that of the linearised line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.line import DRIVES, FORCES, PLACES, Line, Place
from estimator.diagnosis.unnamed.forms import Columns, Form, forms
from estimator.diagnosis.unnamed.scene import Ground, Scene
from estimator.physics.effect import Element
from estimator.physics.parallel import PARTS, concurrently
from estimator.signals.correlation import effective_samples
from estimator.signals.record import FloatArray, IntArray

BATCH = 2**18
"""Values of functions of time that are built and answered at once: enough for compiled code, and no more room."""


@dataclass(frozen=True, slots=True)
class Pool:
    """Laws without a name at one element: functions with a coefficient each, and the output's answers to them."""

    laws: tuple[str, ...]  # the laws, as text
    group: IntArray  # (width,): to which law each function belongs, in order
    answers: FloatArray

    def of(self, laws: Sequence[int]) -> FloatArray:
        """Return the answers to some of the laws, in their order, shape (rows, q)."""
        rows = [np.flatnonzero(self.group == law) for law in laws]
        found: FloatArray = self.answers[np.concatenate([np.zeros(0, dtype=int), *rows])].T
        return found


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


def _answers_of(line: Line, element: Element, functions: FloatArray) -> FloatArray:
    """Return the output's answers to functions of time in one recording, a row each."""
    if PLACES[element] is Place.SENSOR:
        return functions
    motor, load = FORCES[PLACES[element]]
    sign = DRIVES[element]
    return line.tangent.answers(sign * motor, sign * load, functions)


MOST_TERMS = 9
"""Three load steps per recording in a set of three, or as many terms of another kind."""

MOST_COEFFICIENTS = 45

ALIKE = 1e-6
"""A candidate that re-tuning reproduces to this share of its power can't be distinguished from it."""

CHUNK = 2048
"""Rows that are worked on at a time."""

TOO_ALIKE = 1e-8
"""Share of a column's power below which it is a combination of others."""

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
        """Return the coefficients of the first terms, and what they leave of the error, shape (rows,)."""
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
    """Return the triangular factor of columns, shape (q, q), and a target along their orthonormal basis, shape (q,).

    The target is factored with them, as one column more: the basis itself, which takes as long again, is not needed.
    """
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
    alive = after > ALIKE * np.maximum(before, np.finfo(float).tiny)
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
