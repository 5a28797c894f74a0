"""A recording of this rig as CSV, read column by column in blocks: its memory does not grow with its length.

A day at 10 ms is 8.6 million rows, 1 GB of text; a table of them with the text that it is read from takes several times
that. What a run needs to know when it is over, checksum and figures, takes no table.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drivers.foreign_file import open_regular
from hil.recording import columns
from hil.recording.bounds import damaged
from hil.recording.checksum import CHECKSUM, SAID, DataDigest, said_sha256
from hil.recording.description import Sidecar, as_metadata
from hil.recording.table import Column

HEADER = ",".join(columns.UNITS)
"""Begin of the first line of such a recording; the channels of its rig file follow."""

LONGEST_HEADER = 1 << 16  # bytes
BLOCK_BYTES = 1 << 20  # text that is parsed at once
HELD_BYTES = 1 << 25  # cells that are held at once; a recording with more of them is read several times


@dataclass(frozen=True, slots=True)
class Extent:
    """How much a recording holds: rows, times of the first and the last one, and rows that are not good."""

    n_rows: int = 0  # samples
    first_s: float = 0.0  # time of the first row
    last_s: float = 0.0  # time of the last row
    flagged: int = 0  # rows whose flags are not 0

    @property
    def duration_s(self) -> float:
        """N periods [s]."""
        return (self.last_s - self.first_s) * self.n_rows / (self.n_rows - 1) if self.n_rows > 1 else 0.0


def is_own(path: Path) -> bool:
    """Whether a file begins as a recording of this rig in CSV does."""
    own = HEADER.split(",")
    return _names(path)[: len(own)] == own


def _names(path: Path) -> list[str]:
    with open_regular(path) as file:
        return file.readline(LONGEST_HEADER).decode("utf-8", "replace").rstrip("\n").split(",")


def _type(name: str) -> np.dtype[Any]:
    return np.dtype(np.int64 if name == columns.FLAGS else np.float64)


def extent(path: Path) -> Extent:
    """Return how much a recording of this rig holds."""
    n_rows = flagged = 0
    first_s = last_s = 0.0
    for time_s, flags in _blocks(path, (columns.TIME, columns.FLAGS)):
        first_s = first_s if n_rows else float(time_s[0])
        last_s = float(time_s[-1])
        n_rows += time_s.size
        flagged += int(np.count_nonzero(flags))
    return Extent(n_rows, first_s, last_s, flagged)


def data_sha256_at(path: Path, n_rows: int) -> str:
    """Return the checksum of the cells of a recording of this rig (`hil.recording.checksum`), hexadecimal."""
    digest, names = DataDigest(), sorted(_names(path))
    at_once = max(HELD_BYTES // (8 * max(n_rows, 1)), 1)
    for first in range(0, len(names), at_once):
        _take(digest, path, names[first : first + at_once], n_rows)
    return digest.hexdigest()


def own_sidecar(path: Path, metadata: Mapping[str, str], units: Mapping[str, str]) -> Sidecar:
    """Return what has to stand next to a recording of this rig: metadata, units and checksums."""
    try:
        data = data_sha256_at(path, extent(path).n_rows)
    except ValueError as error:
        raise damaged(path, "the rows that were written", error) from error
    checksums = {CHECKSUM: data, SAID: said_sha256(units, metadata)}
    return Sidecar(as_metadata({**metadata, **checksums}), units)


def _take(digest: DataDigest, path: Path, names: Sequence[str], n_rows: int) -> None:
    """Give some columns to a digest: the first of them as it is read, the others when it is."""
    held: dict[str, list[Column]] = {name: [] for name in names[1:]}
    digest.begin(names[0], _type(names[0]), n_rows)
    for first, *others in _blocks(path, names):
        digest.take(first)
        for blocks, block in zip(held.values(), others, strict=True):
            blocks.append(block)
    for name, blocks in held.items():
        digest.begin(name, blocks[0].dtype, n_rows)
        for block in blocks:
            digest.take(block)


def _blocks(path: Path, names: Sequence[str]) -> Iterator[list[Column]]:
    """Read some columns, block by block of rows."""
    import pyarrow as pa  # a tenth of a second, and not before a run is over
    import pyarrow.csv

    with pa.csv.open_csv(
        path,
        pa.csv.ReadOptions(use_threads=False, block_size=BLOCK_BYTES),
        pa.csv.ParseOptions(newlines_in_values=False, ignore_empty_lines=False, quote_char=False),
        pa.csv.ConvertOptions(
            column_types={name: pa.from_numpy_dtype(_type(name)) for name in names},
            include_columns=names,
            null_values=[],
        ),
    ) as rows:
        for block in rows:
            if block.num_rows:
                yield [np.asarray(block.column(name)) for name in names]
    pa.default_memory_pool().release_unused()
