"""A checksum of what a recording holds, the same in every format, by which damage is recognised.

SHA-256 over the columns in the order of their names. Of each: its name, the word for its kind (`hil.recording.table`)
and its cells; a float as IEEE 754 binary64 and an integer as 64 bit two's complement, both little-endian, a truth
value as one byte, a text as UTF-8. Every name, kind and text is preceded by its length in bytes, every column by its
number of cells; lengths are unsigned 64 bit little-endian. All NaN are one, 0x7FF8000000000000: sign and payload of a
NaN mean nothing here.

The order of columns is left out, and units and metadata are: a unit can be put right without the data being others.
These have a checksum of their own, `SAID`: names with the units of their columns, and keys with the metadata, each in
order, as texts preceded by their lengths; the two checksums and ``schema``, which the formats set, are left out.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hil.errors import RecordingError
from hil.recording.table import Column, ColumnKind, Table

CHECKSUM = "data_sha256"  # key of the metadata it is kept under
SAID = "metadata_sha256"  # key of the checksum of units and metadata

CHECKSUMS = frozenset({CHECKSUM, SAID})

_NOT_SAID = CHECKSUMS | {"schema"}

RIG_TEXT, RIG_CHECKSUM = "rig_file", "rig_sha256"

_BLOCK_CELLS = 1 << 18  # cells of a column that are turned into bytes at once
_SHOWN = 12  # digits of a checksum that a message shows


def data_sha256(columns: Mapping[str, Column]) -> str:
    """Return the checksum of columns, hexadecimal."""
    digest = DataDigest()
    for name in sorted(columns):
        column = columns[name]
        digest.begin(name, column.dtype, column.size)
        for first in range(0, column.size, _BLOCK_CELLS):
            digest.take(column[first : first + _BLOCK_CELLS])
    return digest.hexdigest()


class DataDigest:
    """The checksum of columns that come one after the other, in the order of their names, each in blocks."""

    def __init__(self) -> None:
        self._digest = hashlib.sha256()

    def begin(self, name: str, dtype: np.dtype[Any], size: int) -> None:
        """Begin a column of so many cells."""
        for text in (name, ColumnKind.of_dtype(dtype).value):
            self._digest.update(_counted(text))
        self._digest.update(_length(size))

    def take(self, cells: Column) -> None:
        """Take the next cells of the column that was started."""
        self._digest.update(_cells(cells, ColumnKind.of(cells)))

    def hexdigest(self) -> str:
        """Return the SHA-256 of all that was taken, hexadecimal."""
        return self._digest.hexdigest()


def said_sha256(units: Mapping[str, str], metadata: Mapping[str, str]) -> str:
    """Return the checksum of units of columns that are there, and of metadata, hexadecimal."""
    metadata = {key: value for key, value in metadata.items() if key not in _NOT_SAID}
    digest = hashlib.sha256()
    for entries in (units, metadata):
        digest.update(_length(len(entries)))
        for pair in sorted(entries.items()):
            for text in pair:
                digest.update(_counted(text))
    return digest.hexdigest()


def text_sha256(text: str) -> str:
    """Return the checksum of a text as UTF-8, hexadecimal."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def sealed(table: Table) -> Table:
    """Return a table with its checksums among its metadata; one without metadata stays as it is."""
    if not (table.metadata or table.units):
        return table
    checksums = {CHECKSUM: data_sha256(table.columns), SAID: said_sha256(_units_of(table), table.metadata)}
    return replace(table, metadata={**table.metadata, **checksums})


def _units_of(table: Table) -> dict[str, str]:
    return {name: unit for name, unit in table.units.items() if name in table.columns}


def require_whole(table: Table) -> None:
    """Refuse a table that is not what it was when it was written; one without a checksum passes."""
    require_unchanged(table.path, table.metadata, _units_of(table), lambda: data_sha256(table.columns))


def require_unchanged(path: Path, said: Mapping[str, str], units: Mapping[str, str], data: Callable[[], str]) -> None:
    """Refuse metadata, units and data (given by their checksum) that are not what they were when they were written."""
    problems = []
    if CHECKSUM in said and (got := data()) != said[CHECKSUM]:
        problems.append(
            f"expected the data it was written with, SHA-256 {said[CHECKSUM][:_SHOWN]}…, got {got[:_SHOWN]}…: "
            f"it is damaged, or was changed since. Take a copy that is whole; if you changed it yourself, remove "
            f"{CHECKSUM} from what it says of itself (of a CSV: move {path.name}.json away)."
        )
    if SAID in said and (got := said_sha256(units, said)) != said[SAID]:
        problems.append(
            f"expected the units and metadata it was written with, SHA-256 {said[SAID][:_SHOWN]}…, got "
            f"{got[:_SHOWN]}…: what it says of itself is damaged, or was changed since. Take a copy that is whole; if "
            f"you changed it yourself, remove {SAID} from it."
        )
    rig = said.get(RIG_TEXT, "")
    if RIG_CHECKSUM in said and (got := text_sha256(rig)) != said[RIG_CHECKSUM]:
        problems.append(
            f"expected the rig file it was recorded with, SHA-256 {said[RIG_CHECKSUM][:_SHOWN]}…, got "
            f"{got[:_SHOWN]}…: what it says of itself is damaged. Take a copy that is whole."
        )
    if problems:
        raise RecordingError(path, *problems)


def _cells(column: Column, kind: ColumnKind) -> bytes:
    if kind is ColumnKind.FLOAT:
        return np.where(np.isnan(column), np.nan, column).astype("<f8").tobytes()
    if kind is ColumnKind.INTEGER:
        return column.astype("<i8").tobytes()
    if kind is ColumnKind.BOOLEAN:
        return column.astype("u1").tobytes()
    return b"".join(_counted(cell) for cell in column.tolist())


def _counted(text: str) -> bytes:
    raw = text.encode("utf-8", "surrogatepass")
    return _length(len(raw)) + raw


def _length(count: int) -> bytes:
    return count.to_bytes(8, "little")
