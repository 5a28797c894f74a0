"""Settings that make no sense are refused where they are given, by name, with what would be right.

A check is one row of a table (name, value, test, what is expected); one loop reads them all, so that a caller
sees every fault at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from estimator.errors import BadSetting


@dataclass(frozen=True, slots=True)
class Requirement:
    """One row: the setting's name (unit included), its value, whether it fits, and what would."""

    name: str  # as a message names it
    value: float  # that was given
    fits: bool  # whether it is allowed
    expected: str  # what is, as part of a sentence


def require(where: str, rows: Iterable[Requirement]) -> None:
    """Refuse settings that do not fit."""
    faults = [f"{where}: {row.name} is {row.value}, expected {row.expected}." for row in rows if not row.fits]
    if faults:
        raise BadSetting("\n".join(faults))


def is_positive(value: float) -> bool:
    """Tell whether a number is finite and above zero."""
    return math.isfinite(value) and value > 0
