"""When a cycle begins: by the wall clock on a rig, or as fast as the answers come on a simulated one.

The cycle's time is what a `Pacer` says it is; nothing else in the cycle reads a clock. One code path serves
both.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Protocol

NS_PER_S = 1_000_000_000

DISK_PATIENCE_S = 60.0
"""How long a run without a clock may wait for the disk [s]."""

FREE_PATIENCE_S = 5.0
"""How long host, drives and PLC wait for each other at least where the host keeps no clock [s of the wall clock]: such
a run uses the processors up, and the machine may be busy with others."""


def period_ns(period_s: float) -> int:
    """Period in whole nanoseconds, as the pacers count it."""
    return round(period_s * NS_PER_S)


def periods_used_up(late_ns: int, period_ns: int) -> int:
    """Tell how many periods after a cycle's due time the next one is due: one, and those the cycle ran into.

    A cycle that begins late by more than half a period has run into the next one.
    """
    return 1 + (late_ns + period_ns // 2) // period_ns


def answer_timeout_ns(period_ns: int) -> int:
    """How long a device may take to answer a SYNC: four fifths of a period; the rest is for what the host does [ns]."""
    return period_ns * 4 // 5


@dataclass(frozen=True, slots=True)
class Tick:
    """The beginning of one cycle.

    ``due_ns`` is its planned time, always a whole number of periods after the first [ns]; ``late_ns`` is
    how much later it really begins [ns].
    """

    cycle: int  # from 0, counting those that were missed
    due_ns: int
    late_ns: int

    @property
    def now_ns(self) -> int:
        """When it really begins [ns]."""
        return self.due_ns + self.late_ns


class Pacer(Protocol):
    """Says when each cycle begins."""

    period_ns: int  # between two cycles
    answer_timeout_s: float  # how long a device may take to answer a SYNC, by the wall clock
    poll_patience_s: float  # how long a cycle may wait for an answer that is not part of it, such as the PLC's

    def next(self) -> Tick:
        """Return the next cycle, when it is due; `RealTimePacer` sleeps until then."""


def disk_patience_s(pacer: Pacer) -> float:
    """How long a cycle may wait for the disk [s]: not at all where it waits for nothing."""
    return 0.0 if pacer.poll_patience_s == 0.0 else DISK_PATIENCE_S


def device_patience_s(pacer: Pacer) -> float:
    """How long host and devices wait for each other at least [s]: as set for each of them where a clock is kept."""
    return 0.0 if pacer.poll_patience_s == 0.0 else FREE_PATIENCE_S


class RealTimePacer:
    """An absolute schedule on the monotonic clock: a late cycle does not delay those after it."""

    def __init__(self, period_ns: int) -> None:
        self.period_ns = period_ns
        self.answer_timeout_s = answer_timeout_ns(period_ns) / NS_PER_S
        self.poll_patience_s = 0.0  # the torque cycle waits for nothing
        self._next_cycle = 0
        self._due_ns: int | None = None

    def next(self) -> Tick:
        """Sleep until the next cycle is due."""
        now_ns = time.monotonic_ns()
        due_ns = now_ns if self._due_ns is None else self._due_ns
        if due_ns > now_ns:
            time.sleep((due_ns - now_ns) / NS_PER_S)
            now_ns = time.monotonic_ns()
        late_ns = now_ns - due_ns
        tick = Tick(self._next_cycle, due_ns, late_ns)
        used_up = periods_used_up(late_ns, self.period_ns)
        self._due_ns = due_ns + used_up * self.period_ns
        self._next_cycle += used_up
        return tick


class FreePacer:
    """No waiting: simulated time, one period per cycle, however long the answers take."""

    def __init__(self, period_ns: int, answer_timeout_s: float = FREE_PATIENCE_S) -> None:
        self.period_ns = period_ns
        self.answer_timeout_s = self.poll_patience_s = answer_timeout_s
        self._cycle = -1

    def next(self) -> Tick:
        """Return the next cycle at once: due a period after the last, and never late."""
        self._cycle += 1
        return Tick(self._cycle, self._cycle * self.period_ns, 0)
