"""CSV: one header line, one line per row, nothing else.

- Floats are written as the shortest decimal that reads back to the same bits, integers without a point; that
  difference is how a reader tells them apart, so that CSV to Parquet and back loses nothing. Units, metadata and the
  kind of columns whose cells do not tell it stand in a file beside (`hil.recording.sidecar`); without that file text
  that looks like a number becomes one.
- A last line without line end is taken (RFC 4180 allows it): a file cut inside its very last number can't be
  told from a whole one. A cut anywhere else leaves a row with cells missing, and is refused.
- A quoted cell must end on its line, so that a row is a line and every fault has its number.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv

from hil.errors import RecordingError
from hil.recording.bounds import require_columns
from hil.recording.format_hints import FormatHints
from hil.recording.kinds import Kind, as_text
from hil.recording.sidecar import SCHEMA_KEY, TYPES_KEY, UNITS_KEY, Sidecar, read_sidecar, write_sidecar
from hil.recording.table import Column, Table

DELIMITERS = ",;\t|"
"""Tried on the header where no hint is given, the most frequent outside quotes wins."""

QUOTED = re.compile('"[^"]*"')

BLOCK_BYTES = 1 << 22
"""pyarrow parses this much at once; also the longest line it can take."""

FIRST_ROW_LINE = 2

TRUTH = pa.array(["True", "False"])

TABLE_KEYS = frozenset({SCHEMA_KEY, UNITS_KEY, TYPES_KEY})
"""Keys that have a meaning of their own in the file beside, and so can't be metadata."""


def read(path: Path, hints: FormatHints) -> Table:
    """Read a CSV recording.

    Raises
    ------
    RecordingError
        With the line of the fault, if the file is not text in its encoding, has no row, a header with empty
        or repeated names, or a row with another number of cells.
    """
    content = _utf8(path, hints.encoding)
    if not content:
        return Table(path, {})  # refuses: nothing in it
    header = content.split(b"\n", 1)[0].decode("utf-8")
    delimiter = hints.delimiter or max(DELIMITERS, key=QUOTED.sub("", header).count)
    names = _column_names(path, header, delimiter)
    if b"\n" not in content:
        return Table(path, {})  # refuses: no rows
    cells = _parse(path, content, names, delimiter)
    said = read_sidecar(path)
    del content
    columns = {}
    for name in names:
        columns[name] = _column(cells[name], said.types.get(name))
        cells = cells.drop_columns([name])  # a cell as text takes several times what it does as a number
    pa.default_memory_pool().release_unused()
    return Table(path, columns, said.units, said.metadata, FIRST_ROW_LINE)


def write(table: Table, path: Path) -> None:
    """Write a table as CSV, and what it says of itself beside it.

    Raises
    ------
    RecordingError
        If a text cell holds a line break.
    """
    columns = [_cells(table, path, name) for name in table.columns]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(map(_quoted, table.columns)) + "\n")
        file.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
    write_sidecar(path, description_of(table))


def description_of(table: Table) -> Sidecar:
    """Return what has to stand beside a table that is written as CSV."""
    types = {name: Kind.of(column) for name, column in table.columns.items() if not _tells_its_kind(column)}
    return Sidecar({key: value for key, value in table.metadata.items() if key not in TABLE_KEYS}, table.units, types)


def _utf8(path: Path, encoding: str) -> bytes:
    """Read a text file as UTF-8 bytes with line feeds only, no byte order mark, no empty lines at the end."""
    content = path.read_bytes()
    try:
        text = content.decode(encoding)
    except UnicodeError as error:
        start = error.start if isinstance(error, UnicodeDecodeError) else 0
        line = content.count(b"\n", 0, start) + 1
        byte = content[start : start + 1].hex()
        raise RecordingError(
            path,
            f"line {line}: expected {encoding} text, came byte 0x{byte}. "
            'Give its encoding in the model file: [signals] format = { encoding = "latin-1" }.',
        ) from error
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return lines.rstrip("\n").encode("utf-8")


def _split(line: str, delimiter: str) -> list[str]:
    """Cut one line into cells; none where it can't be cut (a cell beyond the module's 128 KiB)."""
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return []


def _column_names(path: Path, header: str, delimiter: str) -> list[str]:
    names = [name.strip() for name in _split(header, delimiter) or [""]]
    require_columns(path, len(names))
    problems = [
        f"line 1: cell {number} of the header is empty, expected a column name"
        for number, name in enumerate(names, start=1)
        if not name
    ]
    repeated = sorted(name for name, count in Counter(names).items() if name and count > 1)
    problems += [f"line 1: column {name} comes twice, expected every name once" for name in repeated]
    if problems:
        raise RecordingError(path, *problems)
    return names


def _parse(path: Path, content: bytes, names: list[str], delimiter: str) -> pa.Table:
    """Cut the rows into cells, all as text."""
    try:
        cells = pa.csv.read_csv(
            pa.BufferReader(content),
            pa.csv.ReadOptions(column_names=names, skip_rows=1, block_size=BLOCK_BYTES),
            pa.csv.ParseOptions(delimiter=delimiter, newlines_in_values=False, ignore_empty_lines=False),
            pa.csv.ConvertOptions(
                column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False, check_utf8=False
            ),
        )
    except pa.ArrowInvalid as error:
        raise RecordingError(path, _broken_line(content, len(names), delimiter)) from error
    if cells.num_rows != content.count(b"\n"):
        raise RecordingError(path, _broken_line(content, len(names), delimiter))
    return cells


def _broken_line(content: bytes, expected: int, delimiter: str) -> str:
    """Find the first line that is no row of the header's number of cells, and say what is wrong with it."""
    lines = content.decode("utf-8").split("\n")
    for number, line in enumerate(lines[1:], start=FIRST_ROW_LINE):
        if line.count('"') % 2:
            return f"line {number}: expected every quoted cell to end on its line, came one that does not"
        count = len(_split(line, delimiter) or [""])
        if count != expected:
            cut = number == len(lines) and count < expected
            cure = "the file is truncated: remove its last line or record again" if cut else "mend that line"
            return f"line {number}: expected {expected} cells as in the header, came {count}; {cure}"
    return f"expected lines shorter than {BLOCK_BYTES} bytes, came a longer one"


def _column(cells: pa.ChunkedArray, kind: Kind | None = None) -> Column:
    """Turn text into the kind it is said to be; unsaid into int64, float64 or text, whichever first fits every cell."""
    if kind is Kind.TEXT:
        return as_text(cells.to_pylist())
    if kind is Kind.BOOLEAN and pa.compute.all(pa.compute.is_in(cells, TRUTH)).as_py():
        return np.asarray(pa.compute.equal(cells, "True").to_numpy())
    trimmed = pa.compute.utf8_trim_whitespace(cells)
    for numeric in (pa.int64(), pa.float64()):
        try:
            return np.asarray(pa.compute.cast(trimmed, numeric).to_numpy())
        except pa.ArrowInvalid:
            continue
    return as_text(trimmed.to_pylist())


def _tells_its_kind(column: Column) -> bool:
    """Whether the cells alone lead a reader to the same column."""
    if Kind.of(column) is not Kind.TEXT:
        return Kind.of(column) is not Kind.BOOLEAN
    read = _column(pa.chunked_array([pa.array(column, type=pa.string())]))
    return Kind.of(read) is Kind.TEXT and bool(np.all(read == column))


def _cells(table: Table, path: Path, name: str) -> Iterable[str]:
    column = table.columns[name]
    if column.dtype != object:
        return map(repr, column.tolist())
    texts = column.tolist()
    broken = next((row for row, text in enumerate(texts) if "\n" in text or "\r" in text), None)
    if broken is not None:
        raise RecordingError(
            path,
            f"column {name}, row {broken + 1}: expected a text of one line, came one with a line break. "
            "CSV can't hold it: write Parquet.",
        )
    return map(_quoted, texts)


def _quoted(text: str) -> str:
    """Quote a text with anything in it that a reader could take for a delimiter, or that would leave a line empty."""
    unclear = not text or any(c in text for c in f'{DELIMITERS}"')
    return '"' + text.replace('"', '""') + '"' if unclear else text
