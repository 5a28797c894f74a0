"""The nominal line beyond what its parameters are trusted to: a wrong data sheet, which is no missing physics.

A fit that ends at a bound of its tolerances leaves what a wrong value makes. Some effect follows a part of that, or two
do: they must explain more than the line itself, its values free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.intervals import covariance
from estimator.diagnosis.result import Stray
from estimator.diagnosis.trial import pressed_parameters
from estimator.physics.fit import FitResult, fit

FREELY = 3.0
"""Factor, either way, within which a nominal parameter is looked for: beyond it a value is no slip of a data sheet, and
the integration's steps, chosen for the nominal line, would not follow."""

CLEARLY = 3.0
"""Standard errors by which a value must lie beyond what it is trusted to."""


@dataclass(frozen=True, slots=True)
class LineBeyond:
    """The nominal line fitted beyond its tolerances.

    Attributes
    ----------
    result : FitResult
    strays : tuple of Stray
        What clearly left its tolerance, the clearest first; at least one.
    """

    result: FitResult
    strays: tuple[Stray, ...]


def line_beyond(retuned: FitResult) -> LineBeyond | None:
    """Fit the nominal line beyond its tolerances, where one inside them ended at their bounds.

    Parameters
    ----------
    retuned : FitResult
        The fit of the nominal parameters within their tolerances, without any effect.

    Returns
    -------
    LineBeyond or None
        None where the tolerances hold nothing back.
    """
    if not pressed_parameters(retuned):
        return None
    shared = tuple(
        s if s.effect or s.low == s.high else replace(s, low=1.0 / FREELY, high=FREELY) for s in retuned.problem.shared
    )
    result = fit(replace(retuned.problem, shared=shared), retuned.x)
    strays = _strays(retuned, result)
    return LineBeyond(result, strays) if strays else None


def _strays(retuned: FitResult, result: FitResult) -> tuple[Stray, ...]:
    spread = np.sqrt(np.maximum(np.diag(covariance(result)), 0.0))
    found = []
    for i, trusted in enumerate(retuned.problem.shared):
        ratio = float(result.x[i])
        by = max(trusted.low - ratio, ratio - trusted.high)
        if not trusted.effect and trusted.low < trusted.high and by > CLEARLY * spread[i]:
            sureness = by / max(float(spread[i]), np.finfo(float).tiny)
            found.append((sureness, Stray(trusted.name, ratio, trusted.high - 1.0)))
    return tuple(stray for _, stray in sorted(found, key=lambda each: -each[0]))


def in_words(strays: Sequence[Stray]) -> str:
    """Say which values are how far from nominal, and how far they are trusted to be."""
    said = []
    for stray in strays:
        side = "above" if stray.ratio > 1.0 else "below"
        away, trusted = 100.0 * abs(stray.ratio - 1.0), 100.0 * stray.tolerance
        said.append(f"{stray.name} {away:.2g} % {side} its nominal value (trusted to {trusted:.2g} %)")
    return " and ".join(said)
