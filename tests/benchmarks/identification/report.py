"""The tables of the benchmark, and the same as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from tests.benchmarks.identification.peers import REFERENCE
from tests.benchmarks.identification.run import Judged
from tests.benchmarks.identification.scores import Coverage, Errors, coverages, errors
from tests.benchmarks.ratios import table

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
    """Return all tables."""
    methods = list(judged[0].answers)
    scored = {name: errors(judged, name) for name in methods}
    reference = scored.get(REFERENCE)
    unit = "in seconds" if reference is None else f"as a ratio to {REFERENCE} ({1e3 * reference.cpu_s:.3g} ms)"
    parts = [f"Processor time per bus {unit}, median.\n\n", table(ERROR_COLUMNS, _rows(scored, reference))]
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
