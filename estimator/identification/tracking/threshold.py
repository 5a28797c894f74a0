"""The threshold of an alarm, from the rate of false ones.

The rule: two statistics in a row beyond a threshold h, on the same side. Each is standardised with the mean m and the
standard deviation s of statistics before, ``tau = (x - m) / (s sqrt(1 + 1/n))``: m of n of them, s with nu degrees of
freedom. Where nothing changes, and the statistics are independent and normal, m and s are as random as they are known
to be::

    m ~ N(0, 1/n),   nu s^2 ~ chi^2(nu),   P(both beyond h) = 2 E[ Q(h s sqrt(1 + 1/n) + m)^2 ]

Q the normal tail. That expectation, over the reference too, times the statistics per hour is the expected number of
false alarms in an hour; a run of three counts twice, so that it is an upper bound.

Two beyond a lower threshold instead of one beyond a higher: a single bump of the road is no alarm, and the rate rests
on the bulk of the distribution, two standard deviations and a half out, and not on tails five out that nobody knows.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import gammaincinv, ndtr, roots_hermitenorm

from estimator.errors import BadSetting
from estimator.signals.record import FloatArray

HIGHEST = 40.0
"""No threshold is sought above."""

QUANTILES = 4000
"""Points at which the distribution of s is taken."""


@cache
def _baseline(n: int, freedom: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how the baseline is distributed: s at its quantiles, and the nodes of m with their weights."""
    nodes, weights = roots_hermitenorm(60)
    probability = (np.arange(QUANTILES) + 0.5) / QUANTILES
    s = np.sqrt(2.0 * gammaincinv(freedom / 2, probability) / freedom)  # chi^2 is twice a gamma variable
    return s, nodes / np.sqrt(n), weights / weights.sum()


def false_pairs(threshold: float, n: int, freedom: int) -> float:
    """Return the probability that two statistics in a row are beyond a threshold, on the same side.

    Parameters
    ----------
    threshold : float
        In standard deviations.
    n : int
        Statistics behind the mean.
    freedom : int
        Degrees of freedom behind the standard deviation.
    """
    s, m, weights = _baseline(n, freedom)
    limit = threshold * np.sqrt(1.0 + 1.0 / n) * s[:, np.newaxis] + m
    return float(2.0 * (ndtr(-limit) ** 2 @ weights).mean())


@cache
def threshold_for(false_alarms_per_hour: float, statistics_per_hour: float, n: int, freedom: int) -> float:
    """Return the threshold that has at most so many false alarms an hour; ``n`` and ``freedom`` of :func:`false_pairs`.

    Raises
    ------
    BadSetting
        If no threshold does.
    """
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
    from scipy.optimize import brentq  # half a second to import, and a run has to start first

    return float(brentq(lambda h: false_pairs(h, n, freedom) - wanted, 0.0, HIGHEST, xtol=1e-9))
