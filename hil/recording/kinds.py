"""The four kinds of column a table has, and how any array becomes one of them without losing a value."""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Column = NDArray[Any]

_LARGEST_INTEGER = np.iinfo(np.int64).max


class Kind(Enum):
    """What the cells of a column are; the value is the word that files use for it."""

    FLOAT = "float"  # float64
    INTEGER = "integer"  # int64
    BOOLEAN = "boolean"  # bool
    TEXT = "text"  # object, every cell a str

    @staticmethod
    def of(column: Column) -> Kind:
        """Tell the kind of a column of a table."""
        return Kind.of_dtype(column.dtype)

    @staticmethod
    def of_dtype(dtype: np.dtype[Any]) -> Kind:
        """Tell the kind of a column by the type of its cells."""
        return _KINDS.get(dtype.kind, Kind.TEXT)


_KINDS = {"f": Kind.FLOAT, "i": Kind.INTEGER, "b": Kind.BOOLEAN}


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
    """Return texts as a column."""
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
