"""What is usual: level and spread of the frequencies that blocks gave, with which those to come are compared.

A block gives a deviation d of the natural frequency with the information p = sum psi^2, so that x = d sqrt(p) has the
same spread for every p as long as noise is what spreads it. What the model lacks spreads d instead, whatever p is.
Which of the two it was, is not known: the variance of d is taken as the larger of both, ``s^2 max(1/p, 1/p_usual)``.
The rate of false alarms then holds for a stronger and for a weaker excitation than the usual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True)
class Spread:
    """How blocks scatter.

    Attributes
    ----------
    of_x : float
        Standard deviation s of d sqrt(p).
    usual : float
        Mean information of the blocks it is known from.
    """

    of_x: float
    usual: float

    def variance(self, information: float) -> float:
        """Return the variance of the deviation that a block of so much information gives [Hz^2]."""
        return self.of_x**2 * max(1.0 / information, 1.0 / self.usual)


@dataclass(frozen=True, slots=True)
class Baseline:
    """Mean deviation of some blocks, weighted by their information.

    Attributes
    ----------
    level_hz : float
        Their mean [Hz].
    information : float
        Of all of them.
    """

    level_hz: float
    information: float

    @classmethod
    def of(cls, deviation_hz: FloatArray, information: FloatArray) -> Baseline:
        """Take the mean of blocks, each array of shape (n,)."""
        total = float(information.sum())
        return cls(float(information @ deviation_hz) / total, total)

    def statistic(self, deviation_hz: float, information: float, tolerated_hz: float, spread: Spread) -> float:
        """Return how far a block is from here, beyond what is tolerated, in standard deviations."""
        away = deviation_hz - self.level_hz
        beyond = np.sign(away) * max(abs(away) - tolerated_hz, 0.0)
        return float(beyond / np.sqrt(spread.variance(information) + spread.of_x**2 / self.information))


def spread_of(number: FloatArray, deviation_hz: FloatArray, information: FloatArray) -> Spread:
    """Return how blocks scatter about a straight line over their numbers, each array of shape (n,), n of 3 or more.

    A line, since a resonance that drifts while it is learnt would be taken for one that scatters.
    """
    mean = (information @ number) / information.sum()
    level = (information @ deviation_hz) / information.sum()
    slope = (information @ ((number - mean) * (deviation_hz - level))) / (information @ (number - mean) ** 2)
    rest = deviation_hz - level - slope * (number - mean)
    return Spread(float(np.sqrt(information @ rest**2 / (number.size - 2))), float(information.mean()))
