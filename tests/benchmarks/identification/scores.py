"""Errors of the methods over many buses, how often printed intervals held the truth, and the tables of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

import numpy as np
from scipy.stats import binomtest

from tests.benchmarks.identification.methods import REFERENCE
from tests.benchmarks.identification.run import Judged
from tests.benchmarks.ratios import table


@dataclass(frozen=True, slots=True)
class Rate:
    """How often something held, and how well that is known."""

    held: int
    runs: int

    @property
    def value(self) -> float:
        """Share; NaN of none."""
        return self.held / self.runs if self.runs else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence (E. B. Wilson, J. American Statistical Association 22, 1927)."""
        ends = binomtest(self.held, self.runs).proportion_ci(method="wilson")
        return float(ends.low), float(ends.high)

    @property
    def text(self) -> str:
        """As a table shows it."""
        if not self.runs:
            return "none"
        low, high = self.interval
        return f"{100 * self.value:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


@dataclass(frozen=True, slots=True)
class Errors:
    """Relative errors of a method over the buses it answered for [%], and what it cost.

    ``worst_seed`` is that of the bus with the largest error of frequency.
    """

    method: str
    frequency_rms: float
    damping_rms: float
    frequency_worst: float
    damping_worst: float
    worst_seed: int
    none: Rate
    cpu_s: float


@dataclass(frozen=True, slots=True)
class Coverage:
    """How often the printed intervals of one quantity held the truth."""

    method: str
    quantity: str
    held: Rate
    held_determined: Rate
    impossible: int
    refused: int
    error_rms: float
    half_width: float
    scatter: float


NORMAL_QUARTILE, NORMAL_95 = 0.67449, 1.95996


def errors(judged: Sequence[Judged], method: str) -> Errors:
    """Return the errors of a method."""
    answered = [one for one in judged if one.answers[method].is_there]
    relative = np.array(
        [
            (one.answers[method].frequency_hz / one.truth["frequency"] - 1.0,
             one.answers[method].damping / one.truth["damping"] - 1.0)
            for one in answered
        ]
    ).reshape(-1, 2)  # fmt: skip
    size = 100.0 * np.abs(relative)
    rms = np.sqrt(np.mean(size**2, axis=0)) if answered else np.full(2, math.nan)
    worst = size.max(axis=0) if answered else np.full(2, math.nan)
    return Errors(
        method=method,
        frequency_rms=float(rms[0]),
        damping_rms=float(rms[1]),
        frequency_worst=float(worst[0]),
        damping_worst=float(worst[1]),
        worst_seed=answered[int(size[:, 0].argmax())].seed if answered else -1,
        none=Rate(len(judged) - len(answered), len(judged)),
        cpu_s=median(one.answers[method].cpu_s for one in judged),
    )


def coverages(judged: Sequence[Judged], method: str) -> list[Coverage]:
    """Return the coverage of every quantity that a method prints with an interval."""
    names = [name for name in judged[0].truth if any(name in one.answers[method].intervals for one in judged)]
    return [coverage(judged, method, name) for name in names]


def coverage(judged: Sequence[Judged], method: str, quantity: str) -> Coverage:
    """Return the coverage of one quantity."""
    pairs = [
        (one.answers[method].intervals[quantity], one.truth[quantity])
        for one in judged
        if quantity in one.answers[method].intervals
    ]
    determined = [(interval, truth) for interval, truth in pairs if interval.is_determined]
    half = np.array([0.5 * (interval.high - interval.low) for interval, _ in pairs])
    error = np.array([interval.value - truth for interval, truth in pairs])
    size = np.abs([truth for _, truth in pairs])
    return Coverage(
        method=method,
        quantity=quantity,
        held=Rate(sum(interval.holds(truth) for interval, truth in pairs), len(pairs)),
        held_determined=Rate(sum(interval.holds(truth) for interval, truth in determined), len(determined)),
        impossible=sum(interval.high <= 0.0 for interval, _ in determined),
        refused=len(judged) - len(pairs),
        error_rms=float(100.0 * np.sqrt(np.mean((error / size) ** 2))),
        half_width=float(100.0 * np.median(half / size)),
        scatter=float(np.median(np.abs(error) / half) * NORMAL_95 / NORMAL_QUARTILE),
    )


GOALS = {"frequency_rms": 0.05, "damping_rms": 0.7, "frequency_worst": 0.5}
"""Wanted of the best estimate [%]."""

HELD = (0.93, 0.97)
"""Wanted of the 95 % intervals."""

ERROR_COLUMNS = (
    "method",
    f"frequency, RMS error (goal {GOALS['frequency_rms']:g} %)",
    f"damping, RMS (goal {GOALS['damping_rms']:g} %)",
    f"frequency, largest (goal {GOALS['frequency_worst']:g} %)",
    "damping, largest",
    "no answer",
    "processor time",
)

COVERAGE_COLUMNS = (
    "intervals of",
    f"held the truth (goal {100 * HELD[0]:.0f} to {100 * HELD[1]:.0f} %)",
    "printed",
    "determined, of them held",
    "impossible",
    "refused",
    "error, RMS",
    "half width, median",
    "error over deviation",
)


def error_row(one: Errors, reference: Errors | None) -> tuple[str, ...]:
    """Return the line of a method."""
    cost = f"{one.cpu_s:.3g} s" if reference is None else f"{one.cpu_s / reference.cpu_s:.2f}"
    return (
        one.method,
        f"{one.frequency_rms:.3f} %",
        f"{one.damping_rms:.2f} %",
        f"{one.frequency_worst:.2f} % (bus {one.worst_seed})",
        f"{one.damping_worst:.1f} %",
        f"{one.none.held} of {one.none.runs}",
        cost,
    )


def least_row(judged: Sequence[Judged]) -> tuple[str, ...]:
    """Return the line of the least RMS errors that an unbiased method can be expected to have on these buses."""
    frequency, damping = 100.0 * np.sqrt(np.mean(np.square([one.least for one in judged]), axis=0))
    return ("least possible (Cramér, Rao)", f"{frequency:.3f} %", f"{damping:.2f} %", "", "", "", "")


def coverage_row(one: Coverage) -> tuple[str, ...]:
    """Return the line of a quantity."""
    determined = one.held_determined
    return (
        one.quantity,
        one.held.text,
        f"{one.held.runs}",
        f"{determined.runs}, {100 * determined.value:.1f} %" if determined.runs else "0",
        f"{one.impossible}",
        f"{one.refused}",
        f"{one.error_rms:.3g} %",
        f"{one.half_width:.3g} %",
        f"{one.scatter:.2f}",
    )


def tables(judged: Sequence[Judged]) -> str:
    methods = list(judged[0].answers)
    scored = {name: errors(judged, name) for name in methods}
    reference = scored.get(REFERENCE)
    unit = "in seconds" if reference is None else f"as a ratio to {REFERENCE} ({1e3 * reference.cpu_s:.3g} ms)"
    rows = [*_rows(scored, reference), least_row(judged)]
    parts = [f"Processor time per bus {unit}, median.\n\n", table(ERROR_COLUMNS, rows)]
    for name in methods:
        covered = coverages(judged, name)
        if covered:
            parts.append(f"\n{name}:\n\n{table(COVERAGE_COLUMNS, [coverage_row(one) for one in covered])}")
    return "".join(parts)


def _rows(scored: Mapping[str, Errors], reference: Errors | None) -> list[tuple[str, ...]]:
    return [error_row(one, reference) for one in scored.values()]


def document(judged: Sequence[Judged], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return everything for a file: settings, scores, and every bus with every answer; NaN as null."""
    methods = list(judged[0].answers)
    found = {
        "settings": dict(settings),
        "errors": [asdict(errors(judged, name)) for name in methods],
        "coverage": [asdict(one) for name in methods for one in coverages(judged, name)],
        "buses": [asdict(one) for one in judged],
    }
    cleaned: dict[str, Any] = _without_nan(found)
    return cleaned


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
