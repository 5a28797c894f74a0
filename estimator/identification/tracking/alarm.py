"""Alarms of a change of the resonance: record, state of the tracking, and the threshold for a rate of false ones.

The rule: two statistics in a row beyond a threshold h, on the same side. Each is standardised with the mean m and the
standard deviation s of statistics before, ``tau = (x - m) / (s sqrt(1 + 1/n))``: m of n of them, s with nu degrees of
freedom. Where nothing changes, and the statistics are independent and normal, two tau have a bivariate t distribution
with nu degrees of freedom, correlated by ``rho = 1 / (n + 1)`` through m. By Plackett's identity for its derivative
with respect to the correlation (Biometrika 41, 1954; A. Genz, Statistics and Computing 14, 2004), from -1, where both
can't be beyond h, up to rho::

    P(both beyond h) = 2 / (2 pi) integral (1 + 2 h^2 / (nu (1 + sin theta)))^(-nu / 2) dtheta,  -pi/2 to asin(rho)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from typing import Any

import numpy as np

from estimator.errors import BadSetting
from estimator.signals.record import FloatArray

NORMAL_95 = 1.959963984540054  # standard deviations that hold 95 % of a normal distribution, either way

HIGHEST = 40.0  # no threshold is sought above
NODES = 200  # of the Gauss-Legendre quadrature: twelve digits for thresholds from 0.1 up
HALVINGS = 40  # of the interval that holds the threshold: to below 1e-10 of `HIGHEST`


@dataclass(frozen=True, slots=True)
class Level:
    """A value with the interval that holds the truth in 95 of 100 cases; unit as the quantity's name says."""

    value: float  # mean over the blocks it was learnt from
    ci95: tuple[float, float]  # lower and upper end

    @classmethod
    def of(cls, value: float, std: float) -> Level:
        """Make the level of a normal estimate with its standard deviation."""
        return cls(value, (value - NORMAL_95 * std, value + NORMAL_95 * std))

    @property
    def std(self) -> float:
        """Standard deviation that the interval is of."""
        return (self.ci95[1] - self.ci95[0]) / (2.0 * NORMAL_95)

    @property
    def statement(self) -> str:
        """Value and interval, four significant digits."""
        return f"{self.value:.4g} ({self.ci95[0]:.4g} to {self.ci95[1]:.4g})"

    def as_json(self) -> dict[str, Any]:
        """Return the level as it stands in a file."""
        return {"value": self.value, "ci95": list(self.ci95)}

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Level:
        """Read what `as_json` gave."""
        low, high = document["ci95"]
        return cls(document["value"], (low, high))


@dataclass(frozen=True, slots=True)
class Alarm:
    """One change that was found."""

    time_s: float  # when it was raised [s]
    changed_between_s: tuple[float, float]  # the change lies between these two moments [s]
    quantity: str  # what changed, its unit at the end
    before: Level  # value before and since
    after: Level  # the level since
    settled: bool  # false while the estimate is on its way
    statistic: float  # the evidence, and what it had to exceed
    threshold: float  # that the statistic went beyond, in standard deviations
    false_alarms_per_hour: float  # what the threshold was made for

    @property
    def statement(self) -> str:
        """One line for a reader at the rig."""
        change = (self.after.value / self.before.value - 1.0) * 100.0
        return (
            f"{self.quantity} changed from {self.before.statement} to {self.after.statement} ({change:+.1f} %) between "
            f"{self.changed_between_s[0]:.1f} and {self.changed_between_s[1]:.1f} s; found at {self.time_s:.1f} s"
            f"{'' if self.settled else ', the estimate had not settled yet'}"
        )

    def as_json(self) -> dict[str, Any]:
        """Return the record as it stands in a file."""
        return {
            "time_s": self.time_s,
            "changed_between_s": list(self.changed_between_s),
            "quantity": self.quantity,
            "before": self.before.as_json(),
            "after": self.after.as_json(),
            "settled": self.settled,
            "evidence": {
                "statistic": self.statistic,
                "threshold": self.threshold,
                "false_alarms_per_hour": self.false_alarms_per_hour,
            },
        }

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Alarm:
        """Read what `as_json` gave."""
        begin_s, end_s = document["changed_between_s"]
        return cls(
            time_s=document["time_s"],
            changed_between_s=(begin_s, end_s),
            quantity=document["quantity"],
            before=Level.from_json(document["before"]),
            after=Level.from_json(document["after"]),
            settled=document["settled"],
            **document["evidence"],
        )


class TrackingState(IntEnum):
    """State of the tracking at a sample; in files and on screens it has the name in small letters."""

    STARTING = 0  # there is no resonance to be watched, yet or for a moment
    LEARNING = 1  # what is usual is being learnt; no alarm can come
    WATCHING = 2  # a change is alarmed
    SETTLING = 3  # after an alarm: the estimate is on its way
    NOT_EXCITED = 4  # the torque says nothing of the resonance: no alarm can come, and the estimate is held or none

    @property
    def word(self) -> str:
        """The state as it stands in a file."""
        return self.name.lower()

    @property
    def words(self) -> str:
        """The state as it stands in a text."""
        return self.word.replace("_", " ")


@cache
def _quadrature() -> tuple[FloatArray, FloatArray]:
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return (nodes + 1.0) / 2, weights / 2


def false_pairs(threshold: float, n: int, freedom: int) -> float:
    """Return the probability that two statistics in a row are beyond a threshold, on the same side."""
    nodes, weights = _quadrature()
    length = np.arcsin(1.0 / (n + 1)) + np.pi / 2
    share = 1.0 + np.sin(nodes * length - np.pi / 2)
    density = (1.0 + 2.0 * threshold**2 / (freedom * share)) ** (-freedom / 2)
    return float(length / np.pi * weights @ density)


@cache
def threshold_for(false_alarms_per_hour: float, statistics_per_hour: float, n: int, freedom: int) -> float:
    """Return the threshold [standard deviations] for a rate of false alarms, the level learnt from n blocks."""
    wanted = false_alarms_per_hour / statistics_per_hour
    if not 0.0 < wanted < false_pairs(0.0, n, freedom):
        raise BadSetting(
            f"alarm: false_alarms_per_hour is {false_alarms_per_hour}, expected above 0 and below "
            f"{statistics_per_hour * false_pairs(0.0, n, freedom):.4g}, what no threshold at all has."
        )
    if false_pairs(HIGHEST, n, freedom) > wanted:
        raise BadSetting(
            f"alarm: false_alarms_per_hour is {false_alarms_per_hour}, fewer than a level of {n} blocks and a spread "
            f"with {freedom} degrees of freedom can promise. Take a longer reference."
        )
    low, high = 0.0, HIGHEST
    for _ in range(HALVINGS):  # the probability falls with the threshold
        middle = (low + high) / 2
        low, high = (middle, high) if false_pairs(middle, n, freedom) > wanted else (low, middle)
    return high
