"""The threshold of an alarm, from the rate of false ones.

The rule: two statistics in a row beyond a threshold h, on the same side. Each is standardised with the mean m and the
standard deviation s of statistics before, ``tau = (x - m) / (s sqrt(1 + 1/n))``: m of n of them, s with nu degrees of
freedom. Where nothing changes, and the statistics are independent and normal, two tau have a bivariate t distribution
with nu degrees of freedom; what they share is m, so that they correlate with ``rho = 1 / (n + 1)``. By Plackett's
identity for its derivative with respect to the correlation (R. L. Plackett, A reduction formula for normal
multivariate integrals, Biometrika 41, 1954; A. Genz, Numerical computation of rectangular bivariate and trivariate
normal and t probabilities, Statistics and Computing 14, 2004), from -1, where both can't be beyond h, up to rho::

    P(both beyond h) = 2 / (2 pi) integral (1 + 2 h^2 / (nu (1 + sin theta)))^(-nu / 2) dtheta,  -pi/2 to asin(rho)

on the one side or the other. That times the statistics per hour is the expected number of false alarms in an hour; a
run of three counts twice, so that it is an upper bound.

Two beyond a lower threshold instead of one beyond a higher: a single bump of the road is no alarm, and the rate rests
on the bulk of the distribution, two standard deviations and a half out, and not on tails five out that nobody knows.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from estimator.errors import BadSetting
from estimator.signals.record import FloatArray

HIGHEST = 40.0
"""No threshold is sought above."""

NODES = 200
"""Of the Gauss-Legendre quadrature: twelve digits for thresholds from 0.1 up."""

HALVINGS = 40
"""Of the interval that holds the threshold: to below 1e-10 of `HIGHEST`."""


@cache
def _quadrature() -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights on the interval from 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return (nodes + 1.0) / 2, weights / 2


def false_pairs(threshold: float, n: int, freedom: int) -> float:
    """Return the probability that two statistics in a row are beyond a threshold, on the same side.

    Parameters
    ----------
    threshold : float
        In standard deviations; 0 or more.
    n : int
        Statistics behind the mean.
    freedom : int
        Degrees of freedom behind the standard deviation.
    """
    nodes, weights = _quadrature()
    length = np.arcsin(1.0 / (n + 1)) + np.pi / 2
    share = 1.0 + np.sin(nodes * length - np.pi / 2)
    density = (1.0 + 2.0 * threshold**2 / (freedom * share)) ** (-freedom / 2)
    return float(length / np.pi * weights @ density)


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
    low, high = 0.0, HIGHEST
    for _ in range(HALVINGS):  # the probability falls with the threshold
        middle = (low + high) / 2
        low, high = (middle, high) if false_pairs(middle, n, freedom) > wanted else (low, middle)
    return high
