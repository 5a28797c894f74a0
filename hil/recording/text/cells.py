"""Cells of a text file: what one alone may be."""

from __future__ import annotations

import re
from enum import Enum
from typing import Final

MISSING: Final = ("", "NA", "N/A", "#N/A", "n/a", "null", "NULL")
"""Cells that say that nothing was read, in addition to nan in any spelling."""

NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:inf|infinity)", re.IGNORECASE)

DATE_TIME: Final = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d{1,9})?)?(?:Z|[+-]\d\d:?\d\d)?")
"""A date with a time of day (ISO 8601)."""


class CellKind(Enum):
    """What a cell alone says of itself."""

    MISSING = "missing"
    NUMBER = "number"
    DATE_TIME = "date_time"
    TEXT = "text"


def kind_of(cell: str, decimal: str = ".") -> CellKind:
    """Tell what a cell is, with a decimal mark."""
    plain = cell.strip()
    if plain in MISSING or plain.lower() == "nan":
        return CellKind.MISSING
    if decimal == ",":
        plain = plain.replace(".", "_").replace(",", ".")
    if NUMBER.fullmatch(plain):
        return CellKind.NUMBER
    return CellKind.DATE_TIME if DATE_TIME.fullmatch(cell.strip()) else CellKind.TEXT
