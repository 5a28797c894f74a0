"""Fits from several starts, and from where another fit ended."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from estimator.physics.fit import ITERATIONS, FitResult, fit
from estimator.physics.parallel import concurrently
from estimator.physics.problem import Problem, start_vector
from estimator.signals.record import FloatArray, IntArray

HEAT = 3
"""Jacobians that each of several starts gets before only the best ones continue."""

CLOSE = 1.1
"""Squared error, over the best start's, up to which a start continues."""

Name = tuple[object, ...]


def best_fit(problems: Sequence[Problem], warm: FitResult | None = None, iterations: int = ITERATIONS) -> FitResult:
    """Fit from several starts and return the best; what a fit ``warm`` has in common starts where that one ended.

    Every start gets a few steps; those that are then close to the best continue.
    """
    if len(problems) == 1:
        return _begun(problems[0], warm, iterations)
    heat = begun(problems, warm, min(HEAT, iterations))
    finals = concurrently(partial(converge, iterations=iterations), [heat[i] for i in close(heat)])
    return min(finals, key=lambda result: result.squares)


def begun(problems: Sequence[Problem], warm: FitResult | None = None, iterations: int = HEAT) -> list[FitResult]:
    """Fit a few steps from each of several starts."""
    return concurrently(partial(_begun, warm=warm, iterations=iterations), problems)


def close(heat: Sequence[FitResult]) -> list[int]:
    """Return which of several fits are close to the best, that first; the others were tried in vain."""
    least = min(result.squares for result in heat)
    order = sorted(range(len(heat)), key=lambda i: heat[i].squares)
    return [i for i in order if heat[i].squares <= CLOSE * least]


def converge(result: FitResult, iterations: int = ITERATIONS) -> FitResult:
    """Continue with a fit that its iteration limit ended."""
    return result if result.converged or iterations <= HEAT else fit(result.problem, result.x, iterations)


def _begun(problem: Problem, warm: FitResult | None, iterations: int) -> FitResult:
    return fit(problem, None if warm is None else warm_start(problem, warm), iterations)


def warm_start(problem: Problem, warm: FitResult) -> FloatArray:
    """Return scaled unknowns, shape (U,): where a fit left them, and those that it lacks where a fit starts."""
    x = start_vector(problem)
    columns, taken, ratio = in_common(problem, warm.problem)
    x[columns] = warm.x[taken] / ratio
    return x


def in_common(problem: Problem, other: Problem) -> tuple[IntArray, IntArray, FloatArray]:
    """Return where the unknowns that two problems have in common stand in each, and the ratio of their scales."""
    place = {name: column for column, name in enumerate(_names(other))}
    pairs = [(column, place[name]) for column, name in enumerate(_names(problem)) if name in place]
    columns, taken = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return columns, taken, _scales(problem)[columns] / _scales(other)[taken]


def _names(problem: Problem) -> list[Name]:
    """Return what tells each unknown from all others."""
    names: list[Name] = [(shared.effect, shared.name) for shared in problem.shared]
    for i, basis in enumerate(problem.bases):
        names += [(i, row) for row in range(basis.own_rows.start)]
        names += [(i, own.effect, own.name) for own in basis.own]
        names += [(i, *basis.profile.shape, row) for row in range(basis.profile.shape[0])]
    return names


def _scales(problem: Problem) -> FloatArray:
    return np.concatenate([[shared.scale for shared in problem.shared], *(basis.scale for basis in problem.bases)])
