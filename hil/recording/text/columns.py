"""Whole columns of cells of a text file, as numbers, times or texts."""

from __future__ import annotations

import re
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.compute

from hil.recording.kinds import Column, Kind, as_text
from hil.recording.text.cells import DATE_TIME, MISSING

NS: Final = 1e-9


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
