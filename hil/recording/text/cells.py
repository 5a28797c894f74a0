"""Cells of a text file: what one may be, and whole columns of them as numbers, times or texts."""

from __future__ import annotations

import re
from enum import Enum
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.compute

from hil.recording.kinds import Column, Kind, as_text

MISSING: Final = ("", "NA", "N/A", "#N/A", "n/a", "null", "NULL")
"""Cells that say that nothing was read, in addition to nan in any spelling."""

NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:inf|infinity)", re.IGNORECASE)

DATE_TIME: Final = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d{1,9})?)?(?:Z|[+-]\d\d:?\d\d)?")
"""A date with a time of day (ISO 8601)."""

NS: Final = 1e-9


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


def as_column(cells: pa.ChunkedArray, kind: Kind | None = None, decimal: str = ".") -> Column:
    """Turn text into the kind it is said to be; unsaid into int64, float64 or text, whichever first fits every cell.

    In a column with a number in it, a missing cell is NaN.
    """
    if kind is Kind.TEXT:
        return as_text(cells.to_pylist())
    if kind is Kind.BOOLEAN and pa.compute.all(pa.compute.is_in(cells, pa.array(["True", "False"]))).as_py():
        return np.asarray(pa.compute.equal(cells, "True").to_numpy())
    trimmed = pa.compute.utf8_trim_whitespace(cells)
    present = pa.compute.if_else(pa.compute.is_in(trimmed, pa.array(MISSING)), pa.scalar(None, pa.string()), trimmed)
    plain = present
    if decimal == ",":
        swapped = pa.compute.replace_substring(present, ".", "_")
        plain = pa.compute.replace_substring(swapped, ",", ".")
    for numeric in (pa.int64(), pa.float64()):
        try:
            numbers = pa.compute.cast(plain, numeric)
        except pa.ArrowInvalid:
            continue
        if numbers.null_count == len(numbers):
            break  # nothing but missing cells: an empty text is one, too
        return np.asarray((numbers.cast(pa.float64()) if numbers.null_count else numbers).to_numpy())
    return as_text(trimmed.to_pylist())


def seconds_of(column: Column) -> tuple[Column, str] | None:
    """Return a column of dates and times as seconds since the first of them, and that one; None where it is none."""
    if column.dtype != object or not all(DATE_TIME.fullmatch(cell) or not cell for cell in column.tolist()):
        return None
    texts = [cell.replace(",", ".") or None for cell in column.tolist()]
    zoned = any(text and re.search(r"(?:Z|[+-]\d\d:?\d\d)$", text[10:]) for text in texts)
    try:
        stamps = pa.array(texts, pa.string()).cast(pa.timestamp("ns", "UTC" if zoned else None))
    except pa.ArrowInvalid:
        return None
    if stamps.null_count == len(stamps):
        return None
    first = next(stamp for stamp in stamps if stamp.is_valid).value
    since = np.asarray(stamps.cast(pa.int64()).to_numpy(zero_copy_only=False), dtype=np.float64)
    if not stamps.null_count:
        since = (stamps.cast(pa.int64()).to_numpy() - first).astype(np.float64)
    else:
        since -= float(first)
    start = next(text for text in texts if text)
    return since * NS, start
