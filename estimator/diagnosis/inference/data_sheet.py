"""A wrong data sheet as a hypothesis: the nominal line, its values beyond what they are trusted to, and no effect.

Where re-tuning ends at a bound, some effect follows a part of what a wrong value leaves, or two do: they must make the
recordings more probable than the line itself does with its values free.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.hypotheses import NOTHING
from estimator.diagnosis.inference.likelihood import Hypothesis, choices_of, covariance, fitted
from estimator.diagnosis.inference.remainder import tests
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.result import Stray
from estimator.physics.fit import not_fitted
from estimator.physics.model import parameter_unit

FREELY = 3.0
"""Factor, either way, within which a nominal parameter is looked for: beyond it a value is no slip of a data sheet, and
the integration's steps, chosen for the nominal line, would not follow."""

CLEARLY = 3.0
"""Standard errors by which a value must lie beyond what it is trusted to."""


@dataclass(frozen=True, slots=True)
class FreeLine:
    """The nominal line with its values free.

    Attributes
    ----------
    score : float
        That of a hypothesis (``likelihood``): a value that is wrong is chosen among all values and effects.
    leaves_noise : bool
        Whether what it leaves passes for noise: then no physics need be missing.
    strays : tuple of Stray
        What clearly left its tolerance, the clearest first; at least one.
    """

    score: float
    leaves_noise: bool
    strays: tuple[Stray, ...]


def free_line(search: Search) -> FreeLine | None:
    """Fit the nominal line beyond its tolerances; None where these hold nothing back."""
    nothing = search.nothing().plain
    shared = nothing.problem.shared
    trusted = [not s.effect and np.isfinite(s.low) and s.low < s.high for s in shared]
    if not any(free and at_bound for free, at_bound in zip(trusted, nothing.pinned, strict=False)):
        return None
    freed = tuple(
        replace(s, low=1.0 / FREELY, high=FREELY) if free else s for s, free in zip(shared, trusted, strict=True)
    )
    problem = replace(nothing.problem, shared=freed)
    sizes, hypotheses = search.nothing().sizes, len(search.names)
    begun = not_fitted(problem, nothing.x)
    found = fitted(NOTHING, begun, sizes, search.limits, hypotheses, search.nothing().minus_twice_log)
    strays = _strays(search, found)
    if not strays:
        return None
    chosen = choices_of(frozenset(stray.name for stray in strays), hypotheses + sum(trusted))
    return FreeLine(found.score + 2.0 * chosen, not any(test.failed for test in tests(found)), strays)


def _strays(search: Search, found: Hypothesis) -> tuple[Stray, ...]:
    spread = np.sqrt(np.maximum(np.diag(covariance(found)), 0.0))
    clear = []
    for i, trusted in enumerate(search.nothing().plain.problem.shared):
        ratio = float(found.plain.x[i])
        by = max(trusted.low - ratio, ratio - trusted.high)
        if not trusted.effect and trusted.low < trusted.high and by > CLEARLY * spread[i]:
            sureness = by / max(float(spread[i]), np.finfo(float).tiny)
            given, unit = search.model.parameters[trusted.name], parameter_unit(trusted.name, search.model.motion)
            clear.append((sureness, Stray(trusted.name, ratio, trusted.high - 1.0, given.value, unit)))
    return tuple(stray for _, stray in sorted(clear, key=lambda each: -each[0]))
