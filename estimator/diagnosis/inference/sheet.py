"""Nominal values off their data sheet: the line alone, its values free, as a rival of every name."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.inference.checks import tests
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import NOTHING, Catalogue, Hypothesis, covariance, fitted
from estimator.diagnosis.inference.trials import Trial, tried
from estimator.diagnosis.result import OffNominal
from estimator.diagnosis.thresholds import Judging
from estimator.physics.driveline import Structure
from estimator.physics.fit import not_fitted
from estimator.physics.model import DrivelineModel, parameter_unit


@dataclass(frozen=True, slots=True)
class FreeLine:
    """The nominal line with its values free."""

    hypothesis: Hypothesis  # without effects
    score: float  # that of the hypothesis, with the price of the choice among the line's values
    leaves_noise: bool  # whether what it leaves passes for noise
    off_nominal: tuple[OffNominal, ...]  # what clearly left its tolerance, the clearest first

    def tried(self, model: DrivelineModel) -> Trial:
        """Return its trial in free simulation, a value off its sheet counted as a law."""
        return tried(self.hypothesis, model, len(self.off_nominal))


def free_line(fits: Fits) -> FreeLine | None:
    """Fit the nominal line beyond its tolerances; None where these hold nothing back."""
    nothing = fits.nothing().result
    shared = nothing.problem.shared
    trusted = [not s.effect and np.isfinite(s.low) and s.low < s.high for s in shared]
    if not any(free and at_bound for free, at_bound in zip(trusted, nothing.pinned, strict=False)):
        return None
    # a joint has nothing to integrate: of its stiffness and damping, one may be none at all
    least = 0.0 if nothing.problem.grid.structure is Structure.JOINT else 1.0 / Judging.FREELY
    freed = tuple(
        replace(s, low=min(s.low, least), high=max(s.high, Judging.FREELY)) if free else s
        for s, free in zip(shared, trusted, strict=True)
    )
    problem = replace(nothing.problem, shared=freed)
    sizes = fits.nothing().sizes
    initial = not_fitted(problem, nothing.x)
    found = fitted(NOTHING, initial, sizes, fits.limits, fits.catalogue, fits.nothing().minus_twice_log)
    off_nominal = _off_nominal(fits, found)
    if not off_nominal:
        return None
    chosen = Catalogue(len(fits.names) + sum(trusted)).choices(frozenset(each.name for each in off_nominal))
    return FreeLine(found, found.score + 2.0 * chosen, not any(test.failed for test in tests(found)), off_nominal)


def _off_nominal(fits: Fits, found: Hypothesis) -> tuple[OffNominal, ...]:
    spread = np.sqrt(np.maximum(np.diag(covariance(found)), 0.0))
    clear = []
    for i, trusted in enumerate(fits.nothing().result.problem.shared):
        ratio = float(found.result.x[i])
        by = max(trusted.low - ratio, ratio - trusted.high)
        if not trusted.effect and trusted.low < trusted.high and by > Judging.CLEARLY * spread[i]:
            sureness = by / max(float(spread[i]), np.finfo(float).tiny)
            given, unit = fits.model.parameters[trusted.name], parameter_unit(trusted.name, fits.model.motion)
            clear.append((sureness, OffNominal(trusted.name, ratio, trusted.high - 1.0, given.value, unit)))
    return tuple(value for _, value in sorted(clear, key=lambda each: -each[0]))
