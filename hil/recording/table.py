"""What a recording file holds: named columns of equal length, units and metadata; nothing of their meaning.

A column is numeric (float64, int64, bool) where every cell is a number, else text. Text is kept, for a recording
may carry columns nobody asks for; it is refused, with its place, when such a column is read as numbers.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil.errors import RecordingError

Column = NDArray[Any]

_LARGEST_INTEGER = np.iinfo(np.int64).max

LARGEST = 1e30
"""Magnitude beyond which a number is no measurement, in whatever unit; its fourth power still is a float."""

LEFT_OUT = ": left out, "  # what every remark on a column that was not read has behind the column's name

NAME_IN_MODEL = "For a foreign recording, name its columns in [signals] of the model file."
NAME_IN_PYTHON = "Name its columns: from_pandas(frame, torque=[...], speed=..., time=...)."

MOST_NAMES = 100  # columns that a refusal lists
LONGEST_CELL = 40  # characters of a wrong cell that a message shows


class ColumnKind(Enum):
    """What the cells of a column are; the value is the word that files use for it."""

    FLOAT = "float"  # float64
    INTEGER = "integer"  # int64
    BOOLEAN = "boolean"  # bool
    TEXT = "text"  # object, every cell a str

    @staticmethod
    def of(column: Column) -> ColumnKind:
        """Tell the kind of a column."""
        return ColumnKind.of_dtype(column.dtype)

    @staticmethod
    def of_dtype(dtype: np.dtype[Any]) -> ColumnKind:
        """Tell the kind of a column by the type of its cells."""
        return _KINDS.get(dtype.kind, ColumnKind.TEXT)


_KINDS = {"f": ColumnKind.FLOAT, "i": ColumnKind.INTEGER, "b": ColumnKind.BOOLEAN}


def is_column(values: Column) -> bool:
    """Whether an array holds numbers, truth values or texts, and so can become a column."""
    return values.dtype.kind in "fiubSUO"


def as_column(values: Column) -> Column:
    """Return any array of numbers, truth values or texts as a column of one of the four kinds.

    Unsigned integers beyond the range of int64 become text: their digits. Bytes are read as UTF-8, what is none as
    latin-1.
    """
    if values.dtype.kind == "u" and values.size and values.max() > _LARGEST_INTEGER:
        return as_text([str(value) for value in values.tolist()])
    wide = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_}.get(values.dtype.kind)
    if wide is not None:
        return np.ascontiguousarray(values, dtype=wide)
    return as_text([_decoded(cell) for cell in values.tolist()])


def as_text(cells: list[str]) -> Column:
    """Return texts as a column of kind TEXT, shape (n,)."""
    column = np.empty(len(cells), dtype=object)
    column[:] = cells
    return column


def _decoded(cell: object) -> str:
    if not isinstance(cell, bytes):
        return "" if cell is None else str(cell)
    try:
        return cell.decode("utf-8")
    except UnicodeDecodeError:
        return cell.decode("latin-1")


def columns_of_shared_length(
    vectors: Mapping[str, Column], wanted: Iterable[str] = ()
) -> tuple[dict[str, Column], tuple[str, ...]]:
    """Choose the vectors of the length that most of those wanted share, or most of all.

    The longest, where two lengths are equally frequent.
    """
    asked = [vectors[name] for name in wanted if name in vectors]
    counts = Counter(vector.size for vector in asked or vectors.values())
    length = max(counts, key=lambda size: (counts[size], size), default=0)
    chosen = {name: vector for name, vector in vectors.items() if vector.size == length}
    return chosen, tuple(
        f"{name}: left out, it has {vector.size} values and the recording {length}"
        for name, vector in vectors.items()
        if vector.size != length
    )


FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Table:
    """The content of one recording; a `RecordingError` where it has no column or row, or columns differ in length."""

    path: Path  #: for messages; its stem is the recording's name
    columns: Mapping[str, Column]  #: float64, int64, bool, or object (text), shape (N,)
    # by column, as the file writes them; columns without one are left out
    units: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)  # texts by key: what the file says of itself
    first_line: int | None = None  #: of the first row in a text file
    remarks: tuple[str, ...] = ()  #: what its reader recognised, had to leave out or fix
    skipped: tuple[int, ...] = ()  #: lines after the first row that are no rows, ascending
    master: str | None = None  #: the column that the file itself calls its time
    elsewhere: Mapping[str, str] = field(default_factory=dict)  #: channels that are no columns here, and why
    is_frame: bool = False  #: of pandas, and of no file

    def __post_init__(self) -> None:
        lengths = {name: column.shape[0] for name, column in self.columns.items()}
        if not lengths or min(lengths.values()) == 0:
            raise RecordingError(
                self.path,
                "expected columns with at least one row, got none: the file is empty or truncated. Record again.",
            )
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise RecordingError(self.path, f"expected columns of one length, got {listed} rows")

    @property
    def n_rows(self) -> int:
        """Number of rows, N."""
        return int(next(iter(self.columns.values())).shape[0])

    @property
    def recognised(self) -> tuple[str, ...]:
        """The remarks but for those on columns that were left out."""
        return tuple(remark for remark in self.remarks if LEFT_OUT not in remark)

    def place(self, row: int) -> str:
        """Name a row (counted from 0) for people: by line of a text file, else by row number from 1."""
        return f"row {row + 1}" if self.first_line is None else f"line {line_of(row, self.first_line, self.skipped)}"

    def numeric(self, names: Iterable[str]) -> dict[str, FloatArray]:
        """Return columns as numbers (float64, shape (N,)); NaN marks a missing value.

        Refuses with a line for each column that is missing, or holds a cell that is no finite number of at most
        `LARGEST`, or NaN.
        """
        wanted = list(dict.fromkeys(names))
        problems = [problem for name in wanted if (problem := self._problem(name))]
        if problems:
            raise RecordingError(self.path, *problems)
        return {name: _as_numbers(self.columns[name]) for name in wanted}

    def _problem(self, name: str) -> str | None:
        column = self.columns.get(name)
        if column is None:
            if name in self.elsewhere:
                return self.elsewhere[name]
            names = [*self.columns, *self.elsewhere]
            listed = ", ".join(each[:LONGEST_CELL] for each in names[:MOST_NAMES])
            more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
            return f"column {name}: missing, the {'frame' if self.is_frame else 'file'} has {listed}{more}. " + (
                NAME_IN_PYTHON if self.is_frame else NAME_IN_MODEL
            )
        row = _first_bad(column)
        if row is None:
            return None
        cell = str(column[row])
        shown = repr(cell[:LONGEST_CELL])
        return f"{self.place(row)}, column {name}: expected a finite number or nan, got {shown}{_hint(cell)}"


def line_of(row: int, first_line: int, skipped: tuple[int, ...]) -> int:
    """Return the line of a row, where some lines after the first row are none."""
    line = row + first_line
    for other in skipped:
        line += other <= line
    return line


def _as_numbers(column: Column) -> FloatArray:
    """Return a column as numbers: an empty text is a missing value, and every NaN the quiet one of arithmetic."""
    if column.dtype == object:
        return np.array([float(cell) if cell else np.nan for cell in column.tolist()], dtype=np.float64)
    with np.errstate(invalid="ignore"):
        numbers: FloatArray = column.astype(np.float64)
        numbers[np.isnan(numbers)] = np.nan
    return numbers


def _first_bad(column: Column) -> int | None:
    """Find the first cell that is neither a number of at most `LARGEST` nor NaN; None where all are."""
    if column.dtype == object:
        return next((row for row, cell in enumerate(column) if not _is_measurement(cell)), None)
    with np.errstate(invalid="ignore"):
        too_large = np.flatnonzero(np.abs(column) > LARGEST) if column.dtype.kind == "f" else np.empty(0)
    return int(too_large[0]) if too_large.size else None


def _is_measurement(cell: str) -> bool:
    try:
        return not cell or not abs(float(cell)) > LARGEST
    except ValueError:
        return False


def _hint(cell: str) -> str:
    """Say what to do about a bad cell whose cause is known."""
    if _is_measurement(cell.replace(",", ".", 1)):
        return ". Write decimals with a point"
    try:
        return "" if math.isinf(float(cell)) else f". Beyond {LARGEST:g} nothing is a measurement: check its unit"
    except ValueError:
        return ""
