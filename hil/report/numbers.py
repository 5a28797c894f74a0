"""Numbers, moments and lists as people read them, and results as programs do."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Any

from pydantic_core import to_jsonable_python

JSON_DIGITS = 10
"""Significant digits in JSON: more than any estimate here carries, without the noise of the last bits."""

SHOWN_DIGITS = 4

LARGEST_RATIO = 1000

SMALLEST_P = 1e-100
"""Below this the exact size of a probability means nothing to anybody."""


def json_number(value: float) -> float | None:
    """Round for JSON; NaN and infinity, which JSON has not, become None."""
    if not math.isfinite(value):
        return None
    rounded = float(f"{value:.{JSON_DIGITS}g}")
    return rounded if math.isfinite(rounded) else value  # the largest doubles round beyond their range


def as_json(result: Any) -> Any:
    """Return a result, or several, as JSON has them: fields by name, enumerations by value, numbers rounded."""
    return _rounded(to_jsonable_python(result, fallback=_plain))


def fields_as_json(result: Any, *names: str) -> dict[str, Any]:
    """Return some fields of a result as JSON has them."""
    return {name: as_json(getattr(result, name)) for name in names}


def _plain(value: Any) -> Any:
    """Return an array as a list, and a mapping of another kind as a dictionary."""
    return value.tolist() if hasattr(value, "tolist") else dict(value)


def _rounded(value: Any) -> Any:
    match value:
        case float():
            return json_number(value)
        case dict():
            return {key: _rounded(each) for key, each in value.items()}
        case list():
            return [_rounded(each) for each in value]
        case _:
            return value


def shown(value: float, unit: str = "") -> str:
    """Format a number for a table: four significant digits and its unit, a dash where there is none."""
    if not math.isfinite(value):
        return "–"
    magnitude = abs(value)
    digits = f"{value:.{SHOWN_DIGITS}g}"
    if 1e4 <= magnitude < 1e6:
        digits = f"{value:.0f}"
    return f"{digits} {unit}".rstrip()


def shown_interval(interval: tuple[float, float]) -> str:
    """Format an interval, for example ``0.02 … 0.022``; one without a width is of a value that no fit moved."""
    low, high = interval
    return "held" if low == high else f"{shown(low)} … {shown(high)}"


def shown_p(value: float) -> str:
    """Format a probability; ``–`` where it is not finite, and no digits below the smallest that says anything."""
    if not math.isfinite(value):
        return "–"
    return f"< {SMALLEST_P:.0e}" if value < SMALLEST_P else f"{value:.2g}"


def p_statement(value: float) -> str:
    """Return a probability as a statement: ``p = 0.02`` or ``p < 1e-100``."""
    shown = shown_p(value)
    return f"p {shown}" if shown.startswith("<") else f"p = {shown}"


def shown_ratio(value: float, reference: float) -> str:
    """Format a value as a multiple of a reference; beyond a thousand the multiple itself says nothing."""
    if not (math.isfinite(value) and reference > 0):
        return "–"
    ratio = value / reference
    return f"{ratio:.3g} ×" if ratio <= LARGEST_RATIO else f"> {LARGEST_RATIO} ×"


def shown_times(intervals: Iterable[tuple[float, float]]) -> str:
    """Format time intervals [s]."""
    return ", ".join(f"{low:.4g} to {high:.4g} s" for low, high in intervals)


def moment(utc: str) -> str:
    """Write a moment in ISO 8601 as a person reads it: ``2026-11-21 10:03 UTC``."""
    return f"{datetime.fromisoformat(utc).astimezone(UTC):%Y-%m-%d %H:%M} UTC"


def listed(words: Sequence[str]) -> str:
    """Join words as in a sentence."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
