"""How often each length of time came, in bounded memory, however long a run is.

Bins are exact below 256 ns and then 128 to every doubling, so that no bin is wider than 1/128 of what is in it: a
quantile is reported at most 0.8 % too high, and never too low. The longest time is kept exactly. 64-bit nanoseconds
fill fewer than 7500 bins.
"""

from __future__ import annotations

from collections import Counter

_STEPS_BITS = 7
_STEPS = 1 << _STEPS_BITS
"""Bins in a doubling."""


class Histogram:
    """Counts of times [ns]."""

    __slots__ = ("_counts", "max_ns")

    def __init__(self) -> None:
        self._counts: Counter[int] = Counter()
        self.max_ns = 0

    def add(self, time_ns: int) -> None:
        """Count one time [ns]; one below zero, which no monotonic clock gives, counts as zero."""
        if time_ns > self.max_ns:
            self.max_ns = time_ns
        self._counts[_bin_of(time_ns) if time_ns > 0 else 0] += 1

    @property
    def total(self) -> int:
        """How many were counted."""
        return self._counts.total()

    def quantile_ns(self, share: float) -> int | None:
        """Give the time that this share of all does not exceed [ns]; None where nothing was counted."""
        rank, below = share * self.total, 0
        for number in sorted(self._counts):
            below += self._counts[number]
            if below >= rank:
                return min(_upper_edge_ns(number), self.max_ns)
        return None

    def bins(self) -> list[tuple[int, int]]:
        """List upper edge [ns] and count of every bin that has one, in rising order."""
        return [(_upper_edge_ns(number), self._counts[number]) for number in sorted(self._counts)]


def _bin_of(time_ns: int) -> int:
    shift = max(time_ns.bit_length() - _STEPS_BITS - 1, 0)
    return shift * _STEPS + (time_ns >> shift)


def _upper_edge_ns(number: int) -> int:
    """Largest time of a bin [ns]."""
    shift = max(number // _STEPS - 1, 0)
    return ((number - shift * _STEPS + 1) << shift) - 1
