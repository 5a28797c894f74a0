"""The way out of a poorer optimum that only one recording's own unknowns are caught in."""

from __future__ import annotations

from estimator.physics import moments, place_in_gap
from estimator.physics.fit import ITERATIONS, FitResult, fit
from estimator.physics.starts import HEAT

ROUNDS, ROUGH_ROUNDS = 3, 1
"""Moves and fits from there, in turn; of a fit that is only begun."""

MOST_ROUNDS = 12
WORTH_A_ROUND = 0.1
"""Share of the squared error that a further round must have taken away for another to be made, up to so many: beside
another effect a moment and that effect's size find each other in small steps."""


def polished(result: FitResult, iterations: int = ITERATIONS) -> FitResult:
    """Move moments of events, and where a joint stood in its gap, to the smallest error, and fit on while it helps."""
    rough = iterations <= HEAT
    for i in range(ROUGH_ROUNDS if rough else MOST_ROUNDS):
        moved = moments.moved(result) or place_in_gap.moved(result)
        if moved is None:
            return result
        better = fit(*moved, iterations)
        if better.squares >= result.squares:
            return result
        gained, result = result.squares - better.squares, better
        if i + 1 >= ROUNDS and gained < WORTH_A_ROUND * (better.squares + gained):
            return result
    return result
