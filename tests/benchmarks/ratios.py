"""Times compared in one run, and the table they are reported in.

A time depends on the machine and on what else runs on it; a ratio of two times taken in turn depends on much less. So
every comparison alternates between its two sides, and what is reported is the ratio of the two medians: of the time
taken, and of processor time, which other programs do not stretch and in which two cores at work count twice.
"""

import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy
import scipy


@dataclass(frozen=True, slots=True)
class Taken:
    """What a job took: time and processor time of all threads [s]."""

    clock_s: float
    processor_s: float


@dataclass(frozen=True, slots=True)
class Comparison:
    """What two ways to do one job took, pair by pair, and what each way gave the last time."""

    ours: tuple[Taken, ...]
    theirs: tuple[Taken, ...]
    our_result: Any
    their_result: Any

    @property
    def ratio(self) -> float:
        """How many times as long the other way takes."""
        return median(each.clock_s for each in self.theirs) / median(each.clock_s for each in self.ours)

    @property
    def processor_ratio(self) -> float:
        """How many times as much processor time the other way takes."""
        return median(each.processor_s for each in self.theirs) / median(each.processor_s for each in self.ours)

    @property
    def spread(self) -> tuple[float, float]:
        """Lowest and highest ratio of processor times of a pair."""
        pairs = [other.processor_s / mine.processor_s for mine, other in zip(self.ours, self.theirs, strict=True)]
        return min(pairs), max(pairs)

    def row(self, what: str) -> tuple[str, ...]:
        """Return a line of the table `COLUMNS`."""
        low, high = self.spread
        medians = [median(each.processor_s for each in side) for side in (self.ours, self.theirs)]
        return (
            what,
            *(f"{seconds:.3g} s" for seconds in medians),
            f"{self.processor_ratio:.3g}",
            f"{low:.3g} to {high:.3g}",
            f"{self.ratio:.3g}",
        )


COLUMNS = ("job", "processor time here", "scipy", "ratio", "pair by pair", "ratio of time taken")


def timed(job: Callable[[], Any]) -> tuple[Taken, Any]:
    """Do a job once; return what it took and what it gave."""
    clock, processor = time.perf_counter(), time.process_time()
    result = job()
    return Taken(time.perf_counter() - clock, time.process_time() - processor), result


def compare(ours: Callable[[], Any], theirs: Callable[[], Any], pairs: int) -> Comparison:
    """Do one job in two ways in turn, so many times each; both must have been warmed up."""
    both = [(timed(ours), timed(theirs)) for _ in range(pairs)]
    return Comparison(
        tuple(mine[0] for mine, _ in both), tuple(other[0] for _, other in both), both[-1][0][1], both[-1][1][1]
    )


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def machine() -> str:
    """Return what the figures were taken on."""
    return (
        f"{len(os.sched_getaffinity(0))} CPUs, {platform.machine()}, Python {platform.python_version()}, "
        f"numpy {numpy.__version__}, scipy {scipy.__version__}\n"
    )
