"""The way out of a poorer optimum that only one recording's own unknowns are caught in."""

from __future__ import annotations

from estimator.physics import moments, place_in_gap
from estimator.physics.fit import ITERATIONS, FitResult, fit
from estimator.physics.starts import HEAT

ROUNDS, ROUGH_ROUNDS = 3, 1
"""Moves and fits from there, in turn; of a fit that is only begun."""


def polished(result: FitResult, iterations: int = ITERATIONS) -> FitResult:
    """Move moments of events, and where a joint stood in its gap, to the smallest error, and fit on while it helps."""
    for _ in range(ROUNDS if iterations > HEAT else ROUGH_ROUNDS):
        moved = moments.moved(result) or place_in_gap.moved(result)
        if moved is None:
            return result
        better = fit(*moved, iterations)
        if better.squares >= result.squares:
            return result
        result = better
    return result
