"""The rival that every name must beat: a law without a name, found by sparse regression at one place of the chain.

Orthogonal matching pursuit (Pati, Rezaiifar, Krishnaprasad, Asilomar 1993) over the candidates of one element, after
everything that re-tuning could explain has been projected out; the BIC decides how many terms, each paying for having
been chosen among many.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.disturbances import Candidate, candidates
from estimator.diagnosis.evidence import Gain, gain_from_squares
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.signals.record import FloatArray

MOST_TERMS = 9
"""Three load steps per recording in a set of three, or as many terms of another kind."""

ALIKE = 1e-6
"""A candidate that re-tuning reproduces to this share of its power can't be told from it."""


@dataclass(frozen=True, slots=True)
class UnnamedLaw:
    """The best law at one element: its terms and coefficients, what it gains, and the RMS it would leave."""

    element: Element
    terms: tuple[tuple[str, float], ...]
    gain: Gain
    rms: float


def best_unnamed(result: FitResult) -> UnnamedLaw | None:
    """Return the law without a name that gains most over a fit; None where no candidate gains anything."""
    found = [law for law in unnamed_laws(result) if law.gain.delta_bic > 0]
    return max(found, key=lambda law: law.gain.delta_bic, default=None)


def unnamed_laws(result: FitResult) -> list[UnnamedLaw]:
    """Return the best law of each element that has candidates."""
    pool = candidates(result)
    projector = _Projector(result)
    return [
        law
        for element in Element
        if (law := _pursue(element, [c for c in pool if c.element is element], projector)) is not None
    ]


class _Projector:
    """Takes out of a signal what the free unknowns of a fit could explain, to first order."""

    def __init__(self, result: FitResult) -> None:
        jacobian = result.jacobian[:, ~result.pinned]
        self._basis = np.linalg.qr(jacobian)[0]
        self._use = result.problem.use
        self.sizes = np.cumsum([int(use.sum()) for use in self._use])[:-1]
        self.unknowns = result.x.size
        self.error = self.rest(result.residual)

    def rest(self, signal: FloatArray) -> FloatArray:
        """Return what is left of a stacked signal, shape (R,)."""
        left: FloatArray = signal - self._basis @ (self._basis.T @ signal)
        return left

    def answer(self, candidate: Candidate) -> tuple[FloatArray, float]:
        """Return what is left of a candidate's answer, scaled to unit norm, and its norm; all 0 where nothing is."""
        stacked = np.concatenate([a[use] for a, use in zip(candidate.answers, self._use, strict=True)])
        left = self.rest(stacked)
        norm = float(np.linalg.norm(left))
        if norm**2 <= ALIKE * float(stacked @ stacked):
            return np.zeros_like(left), 0.0
        return left / norm, norm


def _pursue(element: Element, pool: list[Candidate], projector: _Projector) -> UnnamedLaw | None:
    if not pool:
        return None
    scaled = [projector.answer(candidate) for candidate in pool]
    answers = np.array([answer for answer, _ in scaled])
    norms = np.array([norm for _, norm in scaled])
    error = projector.error
    chosen: list[int] = []
    best: UnnamedLaw | None = None
    left, coefficients = error, np.empty(0)
    for _ in range(min(MOST_TERMS, len(pool))):
        match = np.abs(answers @ left)
        match[chosen] = 0.0
        if match.max() <= 0.0:
            break
        chosen.append(int(match.argmax()))
        coefficients = np.linalg.lstsq(answers[chosen].T, error, rcond=None)[0]
        left = error - coefficients @ answers[chosen]
        terms = [(pool[i].law, float(-c / norms[i])) for i, c in zip(chosen, coefficients, strict=True)]
        law = _law(element, terms, error, left, projector, len(pool))
        if best is None or law.gain.delta_bic > best.gain.delta_bic:
            best = law
    return best


def _law(
    element: Element,
    terms: list[tuple[str, float]],
    error: FloatArray,
    left: FloatArray,
    projector: _Projector,
    pool_size: int,
) -> UnnamedLaw:
    raw = gain_from_squares(
        float(error @ error),
        float(left @ left),
        len(terms),
        projector.unknowns + len(terms),
        np.split(left, projector.sizes),
    )
    choices = 2.0 * len(terms) * math.log(pool_size)
    p_value = min(1.0, raw.p_value * math.comb(pool_size, len(terms)))
    return UnnamedLaw(
        element,
        tuple(terms),
        Gain(raw.delta_bic - choices, p_value, raw.n_effective),
        float(np.sqrt(np.mean(left**2))),
    )
