"""What is usual in a fleet, who is not, and since when: a hierarchical model, estimated by empirical Bayes.

Of one parameter, recording r of vehicle v gives y with standard deviation s::

    y_vr ~ N(theta_v, omega^2 + s_vr^2)      omega: what differs from drive to drive: payload, temperature, road
    theta_v ~ N(mu, tau^2)                   tau: what differs from vehicle to vehicle
              N(mu, (WIDER tau)^2)           of the few, a share of FEW, that are not as the others

mu, tau and omega are common to the fleet and maximise the marginal likelihood (G. Casella, An introduction to empirical
Bayes data analysis, The American Statistician 39, 1985). The wide part keeps vehicles with a fault from widening tau
until they are usual themselves (two groups: B. Efron, Statistical Science 23, 2008). Of the vehicle, theta_v then has
the mean of its own recordings, weighted, drawn towards mu by the prior's share.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.stats import norm

from estimator.physics.model import DrivelineModel, Parameter
from estimator.signals.record import FloatArray, IntArray

FALSE_RATE = 0.002
"""Share of the vehicles that are usual, and named all the same, two-sided; likewise of the changes."""

FEW, WIDER = 0.05, 8.0
"""Share of the vehicles that may be as they like, and how much wider their spread is."""

FEWEST_VEHICLES = 8
"""With fewer, their spread is hardly known: twice too large or too small."""

QUANTILE = float(norm.ppf(0.975))


@dataclass(frozen=True, slots=True)
class Seen:
    """The values of one parameter in the recordings of a vehicle, in the order of time, shape (n,) each."""

    value: FloatArray  # in the parameter's unit
    std: FloatArray  # from the 95 % interval; 0 where there is none


@dataclass(frozen=True, slots=True)
class Usual:
    """What is usual: mean, spread over vehicles, and spread over the drives of one vehicle."""

    mean: float  # over vehicles
    between: float  # tau, standard deviation over vehicles
    within: float  # omega, standard deviation over the drives of one vehicle, beyond what their own intervals make
    n_vehicles: int  # that it was estimated from


@dataclass(frozen=True, slots=True)
class Pooled:
    """What is known of a vehicle's parameter from all its recordings and from the fleet."""

    value: float  # mean of the posterior
    std: float  # of the posterior: of the vehicle's level, not of a single drive
    from_fleet: float  # share of the value that came from the prior
    away: float  # from what is usual to its own recordings alone, in standard deviations of a usual vehicle's

    @property
    def is_outlier(self) -> bool:
        """Whether the vehicle is not as the others, at `FALSE_RATE`."""
        return abs(self.away) > threshold(1)


@dataclass(frozen=True, slots=True)
class Change:
    """A step in a vehicle's recordings: which is the first of the new level, both levels, and how many deviations."""

    first: int  # its place among the recordings, from 0
    before: float  # weighted mean of the recordings before it
    after: float  # weighted mean of it and those after it
    away: float  # signed: positive where the level rose


def threshold(comparisons: int) -> float:
    """Return the standard deviations beyond which one of so many comparisons is by chance at `FALSE_RATE`."""
    return float(norm.isf(FALSE_RATE / 2.0 / comparisons))


def _own(seen: Seen, within: float) -> tuple[float, float]:
    """Return the mean of a vehicle's recordings and its variance."""
    weight = 1.0 / (within**2 + seen.std**2)
    return float(weight @ seen.value / weight.sum()), float(1.0 / weight.sum())


def _deviance(x: FloatArray, value: FloatArray, std: FloatArray, sizes: IntArray) -> float:
    """Return -2 log of the marginal likelihood at ``mu, log tau, log omega``; ``sizes`` cuts values into vehicles."""
    mean, between, within = x[0], math.exp(x[1]), math.exp(x[2])
    weight, first = 1.0 / (within**2 + std**2), np.cumsum(sizes) - sizes
    total = np.add.reduceat(weight, first)
    level = np.add.reduceat(weight * value, first) / total
    usual_one, other = (
        math.log(share) + norm.logpdf(level, mean, np.sqrt(1.0 / total + spread**2))
        for share, spread in ((1.0 - FEW, between), (FEW, WIDER * between))
    )
    own = weight * (value - np.repeat(level, sizes)) ** 2 - np.log(weight)
    return float(own.sum() + np.sum(np.log(total) - 2.0 * np.logaddexp(usual_one, other)))


def usual(vehicles: Sequence[Seen]) -> Usual:
    """Estimate what is usual."""
    levels = np.array([each.value.mean() for each in vehicles])
    middle = float(np.median(levels))
    scale = 1.4826 * float(np.median(np.abs(levels - middle))) or 1e-6 * abs(middle) or 1e-9
    low, high = math.log(1e-3 * scale), math.log(1e3 * scale)
    bounds = [(middle - 10.0 * scale, middle + 10.0 * scale), (low, high), (low, high)]
    start = np.array([middle, math.log(scale), math.log(scale)])
    simplex = start + np.vstack([np.zeros(3), np.diag([0.5 * scale, 0.7, 0.7])])
    options: Any = {"initial_simplex": simplex, "xatol": 1e-3 * min(scale, 1.0), "fatol": 1e-3}
    of_all = (np.concatenate([each.value for each in vehicles]), np.concatenate([each.std for each in vehicles]))
    sizes = np.array([each.value.size for each in vehicles])
    found = minimize(_deviance, start, (*of_all, sizes), method="Nelder-Mead", bounds=bounds, options=options).x
    return Usual(float(found[0]), math.exp(found[1]), math.exp(found[2]), len(vehicles))


def pooled(seen: Seen, known: Usual) -> Pooled:
    """Return what is known of a vehicle, given what is usual."""
    own, variance = _own(seen, known.within)
    share = variance / (variance + known.between**2)
    return Pooled(
        value=share * known.mean + (1.0 - share) * own,
        std=math.sqrt(variance * (1.0 - share)),
        from_fleet=share,
        away=(own - known.mean) / math.sqrt(variance + known.between**2),
    )


def change(seen: Seen, within: float) -> Change | None:
    """Return the largest step in a vehicle's recordings, where it is more than chance.

    The likelihood ratio of two levels against one over every moment (M. Basseville and I. V. Nikiforov, Detection of
    Abrupt Changes, 1993, section 2.6), with the levels' own spread; the moments are the comparisons that are paid for.
    """
    weight = 1.0 / (within**2 + seen.std**2)
    n = seen.value.size
    best: Change | None = None
    for first in range(1, n):
        before, after = (
            float(weight[part] @ seen.value[part] / weight[part].sum()) for part in (slice(first), slice(first, n))
        )
        spread = math.sqrt(1.0 / weight[:first].sum() + 1.0 / weight[first:].sum())
        if best is None or abs(after - before) / spread > abs(best.away):
            best = Change(first, before, after, (after - before) / spread)
    return best if best is not None and abs(best.away) > threshold(n - 1) else None


def with_prior(model: DrivelineModel, known: Mapping[str, Usual]) -> tuple[DrivelineModel, tuple[str, ...]]:
    """Return a model whose parameters are what is usual, with the interval of 95 % of the vehicles and drives."""
    priors = {}
    for name, each in known.items():
        if name in model.parameters and each.n_vehicles >= FEWEST_VEHICLES and each.mean > 0.0:
            priors[name] = Parameter.measured(each.mean, QUANTILE * math.hypot(each.between, each.within), 0.0)
    return replace(model, parameters={**model.parameters, **priors}), tuple(priors)
