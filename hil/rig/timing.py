"""What a run's cycles did in time: when they began, how far apart, and how long the answers took.

Three times of every cycle, from the first with both inverters armed to the last:

period     from one SYNC to the next
lateness   from when the cycle was due to when it began
reply age  from the SYNC to the arrival of an inverter's TPDO, each inverter counted by itself

and three counts: cycles that were missed altogether, that began later than half a period, and answers that did
not come in time.

How often each length of time came is kept in bounded memory, however long a run is. Bins are exact below 256 ns and
then 128 to every doubling, so that no bin is wider than 1/128 of what is in it: a quantile is reported at most 0.8 %
too high, and never too low. The longest time is kept exactly. 64-bit nanoseconds fill fewer than 7500 bins.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from hil.rig.pacing import Tick

_STEPS_BITS = 7
_STEPS = 1 << _STEPS_BITS
"""Bins in a doubling."""

SCHEMA = "hil.timing/1"

QUANTILES = (("p50", 0.5), ("p99", 0.99), ("p99.9", 0.999))


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


@dataclass(slots=True)
class RunTiming:
    """The timing record of one run."""

    period_ns: int  # what the period should be [ns]
    period: Histogram = field(default_factory=Histogram)  # from one SYNC to the next of successive cycles [ns]
    lateness: Histogram = field(default_factory=Histogram)  # of each cycle that took place [ns]
    reply_age: Histogram = field(default_factory=Histogram)  # of each answer that came in time, of either inverter [ns]
    cycles: int = 0  # cycles that took place
    missed: int = 0  # cycles that did not
    late: int = 0  # cycles that began later than half a period
    unanswered: int = 0  # answers that did not come in time, of either inverter
    _last_cycle: int | None = None  # number of the latest cycle; None before the first
    _last_sync_ns: int | None = None  # host time of its SYNC

    def begin(self, tick: Tick, sync_ns: int) -> None:
        """Take note of a cycle that begins, and of its SYNC [ns]."""
        self.cycles += 1
        self.lateness.add(tick.late_ns)
        self.late += self.is_late(tick)
        if self._last_cycle is not None and self._last_sync_ns is not None:
            self.missed += tick.cycle - self._last_cycle - 1
            self.period.add(sync_ns - self._last_sync_ns)
        self._last_cycle, self._last_sync_ns = tick.cycle, sync_ns

    def is_late(self, tick: Tick) -> bool:
        """Whether a cycle began later than half a period."""
        return 2 * tick.late_ns > self.period_ns

    def answer(self, age_ns: int | None) -> None:
        """Take note of an inverter's answer: its age on arrival [ns], None where it did not come in time."""
        if age_ns is None:
            self.unanswered += 1
        else:
            self.reply_age.add(age_ns)

    def as_json(self) -> dict[str, Any]:
        """Give the record as a JSON document, ``hil.timing/1``: times in seconds, every bin that has a count."""
        return {
            "schema": SCHEMA,
            "period_s": self.period_ns / 1e9,
            "cycles": self.cycles,
            "missed": self.missed,
            "late": self.late,
            "unanswered": self.unanswered,
            "period": _histogram(self.period),
            "lateness": _histogram(self.lateness),
            "reply_age": _histogram(self.reply_age),
        }


def _histogram(histogram: Histogram) -> dict[str, Any]:
    quantiles = {f"{name}_s": _seconds(histogram.quantile_ns(share)) for name, share in QUANTILES}
    return {
        "count": histogram.total,
        **quantiles,
        "max_s": _seconds(histogram.max_ns if histogram.total else None),
        "bins": [[edge_ns / 1e9, count] for edge_ns, count in histogram.bins()],
    }


def _seconds(time_ns: int | None) -> float | None:
    return None if time_ns is None else time_ns / 1e9


def timing_lines(timing: RunTiming) -> list[str]:
    """Tell the record in a few lines for people."""
    rows = (("period", timing.period), ("lateness", timing.lateness), ("reply age", timing.reply_age))
    lines = [f"{'[ms]':10}" + "".join(f"{name:>10}" for name in (*(name for name, _ in QUANTILES), "max"))]
    for what, histogram in rows:
        times_ns = [*(histogram.quantile_ns(share) for _, share in QUANTILES), histogram.max_ns]
        lines.append(f"{what:10}" + "".join(f"{_milliseconds(time_ns):>10}" for time_ns in times_ns))
    lines.append(
        f"{timing.cycles} cycles, {timing.missed} missed, {timing.late} late by more than half a period, "
        f"{timing.unanswered} answers missing"
    )
    return lines


def _milliseconds(time_ns: int | None) -> str:
    return "" if time_ns is None else f"{time_ns / 1e6:.3f}"
