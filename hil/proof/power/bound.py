r"""How small an effect any test at all could find: the likelihood-ratio test of two simple hypotheses.

With white noise of known deviation sigma, the most powerful test between two known outputs that differ by Delta has the
power Phi(d - z_{1-alpha}), d = |Delta| / sigma (Neyman and Pearson, Phil. Trans. A 231, 1933; Kay, Fundamentals of
Statistical Signal Processing II, 1998, sec. 4.3). Where nuisance parameters are unknown, what of Delta they could
imitate is lost to any test that is indifferent to them: d = |(I - P) Delta| / sigma, P the projector on the outputs'
sensitivities (Scharf and Friedlander, IEEE Trans. Signal Process. 42, 1994). Where the torques are known by their
readings only, the noise is no longer white, and both are taken of the whitened outputs (`hil.proof.power.noise`).

All of these tests look for one effect, on one side, and know its law.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from hil.proof.power.drive import drive, under_torques_of
from hil.proof.power.noise import deviation_rad_s, whitened
from hil.proof.power.nuisance import orthonormal, sensitivities, without
from hil.proof.power.sizes import imposed, scale_of
from hil.proof.truth.case import TESTS
from hil.proof.truth.experiments import SAMPLES
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.registry import EFFECTS
from hil.proof.truth.specimen import Specimen

LEVEL = 0.05
"""Probability of a name by chance per diagnosis, all hypotheses together: what the tool allows itself."""

HYPOTHESES = sum(effect.catalogued for effect in EFFECTS.values()) - 1
"""Entries of the catalogue, among which ``LEVEL`` is divided; one of the registered effects is nothing."""

POWER = 0.9

CLOSE = 1e-3
"""Relative error of a size that was searched."""

FARTHEST = 1e6
"""Factor from its start within which a size is searched."""

STRETCH = math.e
"""Factor by which a bracket grows."""


@dataclass(frozen=True, slots=True)
class Distance:
    """How far apart the outputs with an effect and without are, over the deviation of the noise.

    Attributes
    ----------
    known : float
        |Delta| / sigma: to a test that knows everything else.
    bus_unknown : float
        |(I - P) Delta| / sigma: to one that has to estimate bus, load torques and initial states.
    recorded : float
        The same of the whitened outputs: to one that has the recordings and nothing else.
    """

    known: float
    bus_unknown: float
    recorded: float


@dataclass(frozen=True, slots=True)
class Bound:
    """Sizes of an effect that the best test finds with `POWER`, in the effect's unit; by what it knows, as above."""

    known: float
    bus_unknown: float
    recorded: float


def threshold(alpha: float) -> float:
    """Return z_{1-alpha}: what a distance exceeds by chance alone with probability alpha."""
    return float(stats.norm.isf(alpha))


def power(distance: float, alpha: float) -> float:
    """Return the probability that the best test of level alpha finds what is a distance away."""
    return float(stats.norm.cdf(distance - threshold(alpha)))


def needed_distance(alpha: float, wanted: float = POWER) -> float:
    """Return the distance that the best test of level alpha finds with a wanted power."""
    return threshold(alpha) + float(stats.norm.ppf(wanted))


def size_at(needed: float, distance: Callable[[float], float], start: float) -> float:
    """Return the size at which a growing distance reaches what is needed, to a share of `CLOSE`.

    Parameters
    ----------
    needed
        The distance.
    distance
        Of a size greater than 0.
    start
        A size to begin with.

    Raises
    ------
    ValueError
        If no size within a factor of `FARTHEST` of the start has that distance.
    """
    known: dict[float, float] = {}

    def excess(log_size: float) -> float:
        if log_size not in known:
            known[log_size] = math.log(max(distance(math.exp(log_size)), sys.float_info.min)) - math.log(needed)
        return known[log_size]

    low = high = math.log(start)
    least, most = low - math.log(FARTHEST), low + math.log(FARTHEST)
    while excess(low) > 0.0 and low > least:
        high, low = low, low - math.log(STRETCH)
    while excess(high) < 0.0 and high < most:
        low, high = high, high + math.log(STRETCH)
    if excess(low) > 0.0 or excess(high) < 0.0:
        raise ValueError(
            f"size: expected one between {math.exp(least):.3g} and {math.exp(most):.3g} at a distance of {needed:.3g}, "
            f"got {distance(math.exp(low)):.3g} at {math.exp(low):.3g} and {distance(math.exp(high)):.3g} at "
            f"{math.exp(high):.3g}. Does the effect vanish with its size?"
        )
    return math.exp(optimize.brentq(excess, low, high, xtol=CLOSE))


class Yardstick:
    """Measures how far the outputs of one specimen are from those without its effect.

    Parameters
    ----------
    specimen
        Hides one effect with a single size.
    samples
        Length N of each of the three recordings.
    """

    def __init__(self, specimen: Specimen, samples: int = SAMPLES) -> None:
        self._specimen = specimen
        self._scale = scale_of(specimen.effect)
        self._absent = imposed(specimen, self._scale.least)
        self._samples = samples
        self._deviation = deviation_rad_s(specimen.acquisition())
        moved = sensitivities(specimen.seed, samples)
        self._nuisance = orthonormal(moved)
        self._nuisance_whitened = orthonormal(whitened(moved, specimen.seed, samples))
        self._distances: dict[float, Distance] = {}

    def difference_rad_s(self, size: float) -> FloatArray:
        """Return Delta, the recordings one behind the other, shape (3 N,): with the effect less without."""
        specimen = imposed(self._specimen, size)
        return np.concatenate([self._difference(specimen, test) for test in range(len(TESTS))])

    def _difference(self, specimen: Specimen, test: int) -> FloatArray:
        there = drive(specimen, test, self._samples)
        absent = under_torques_of(there, self._absent, test)
        return there.speed_rad_s() - absent.speed_rad_s()

    def distance(self, size: float) -> Distance:
        """Return how far apart the outputs are at a size."""
        if size not in self._distances:
            difference = self.difference_rad_s(size)
            even = whitened(difference, self._specimen.seed, self._samples)
            self._distances[size] = Distance(
                known=float(np.linalg.norm(difference)) / self._deviation,
                bus_unknown=float(np.linalg.norm(without(self._nuisance, difference))) / self._deviation,
                recorded=float(np.linalg.norm(without(self._nuisance_whitened, even))),
            )
        return self._distances[size]

    def bound(self, alpha: float) -> Bound:
        """Return the sizes found with `POWER` at a level."""
        needed, start = needed_distance(alpha), self._scale.start
        return Bound(
            known=size_at(needed, lambda size: self.distance(size).known, start),
            bus_unknown=size_at(needed, lambda size: self.distance(size).bus_unknown, start),
            recorded=size_at(needed, lambda size: self.distance(size).recorded, start),
        )
