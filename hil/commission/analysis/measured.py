"""A measured number with its 95 % interval, from the scatter of repeats."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from estimator.signals.record import FloatArray

Z95 = 1.959963984540054
"""97.5 % point of the normal distribution."""

TRUSTED = 0.2
"""Tolerance that the parameters of a model from here are given: temperature, load and tyres move them by as much."""


@dataclass(frozen=True, slots=True)
class Measured:
    """A value and half the width of its 95 % interval; infinite where the data don't tell."""

    value: float
    ci95: float

    def is_within(self, low: float, high: float) -> bool | None:
        """Tell whether the value lies in a range: None where the interval is on both sides of a limit."""
        if low <= self.value - self.ci95 and self.value + self.ci95 <= high:
            return True
        if self.value + self.ci95 < low or self.value - self.ci95 > high:
            return False
        return None

    @property
    def is_seen(self) -> bool:
        """Whether zero is outside the interval."""
        return abs(self.value) > self.ci95

    def shown(self, unit: str = "", scale: float = 1.0) -> str:
        """Return ``3.1 ± 0.4 %``: the interval with two digits, the value with as many places."""
        value, spread = scale * self.value, scale * self.ci95
        if not math.isfinite(spread) or not math.isfinite(value):
            return "not determined"
        places = 0 if spread <= 0.0 else max(0, 1 - math.floor(math.log10(spread)))
        return f"{value:z.{places}f} ± {spread:.{places}f} {unit}".rstrip()

    def shown_as(self, above: str, below: str, unit: str = "", scale: float = 1.0) -> str:
        """Return ``0.12 ± 0.09 ms earlier``: the size, and a word for each sign."""
        size = Measured(abs(self.value), self.ci95)
        return f"{size.shown(unit, scale)} {below if self.value < 0.0 else above}"


def of_repeats(values: FloatArray) -> Measured:
    """Return the mean of independent repeats, shape (n,), and its interval by Student's t; n = 1 tells nothing."""
    n = values.shape[0]
    if n < 2:
        return Measured(float(np.mean(values)) if n else math.nan, math.inf)
    from scipy.stats import t as student  # half a second, and the bus comes first

    spread = float(student.ppf(0.975, n - 1) * np.std(values, ddof=1) / math.sqrt(n))
    return Measured(float(np.mean(values)), spread)
