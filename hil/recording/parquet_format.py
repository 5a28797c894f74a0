"""Parquet, Feather and lines of JSON: what Arrow reads. Parquet is also written, units and metadata in the schema."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.ipc
import pyarrow.parquet

from hil.errors import RecordingError
from hil.recording.bounds import damaged, require_cells, require_columns
from hil.recording.channels import column_of
from hil.recording.request import Request
from hil.recording.table import Column, Table, as_column, as_text

UNIT_KEY = b"unit"

DAMAGED = (pa.ArrowException, OSError, UnicodeDecodeError)
"""What pyarrow raises on a file that is cut or damaged; the last where a name or a text is no UTF-8."""

FOREIGN_KEYS = frozenset({b"pandas", b"ARROW:schema"})  # metadata other programs put there for themselves


def read(path: Path, request: Request) -> Table:
    """Read a Parquet recording whole, its pages verified where they have checksums."""
    try:
        with pa.parquet.ParquetFile(path, page_checksum_verification=True) as file:
            _require_sizes(path, file.metadata)
            content = file.read()
            names = _names(path, content)
    except DAMAGED as error:
        raise damaged(path, "a whole Parquet file", error) from error
    return _table(path, content, names, "a whole Parquet file")


def read_feather(path: Path, request: Request) -> Table:
    """Read a file of Arrow (IPC, also called Feather), or what was streamed into one."""
    from pyarrow import feather

    what = "a whole Feather file" if path.suffix.lower() == ".feather" else "a whole Arrow file"
    try:
        with path.open("rb") as file:
            is_stream = not file.read(6).startswith((b"ARROW1", b"FEA1"))
        if is_stream:
            with path.open("rb") as file, pa.ipc.open_stream(file) as stream:
                content = stream.read_all()
        else:
            content = feather.read_table(path, memory_map=False)
    except DAMAGED as error:
        raise damaged(path, what, error) from error
    require_cells(path, content.num_rows * content.num_columns)
    return _table(path, content, _names(path, content), what)


def read_json_lines(path: Path, request: Request) -> Table:
    """Read lines of JSON, an object each; what is in an object of its own is called by its path."""
    from pyarrow import json

    what = "a JSON object on every line"
    try:
        content = json.read_json(path)
        while any(pa.types.is_struct(each.type) for each in content.schema):
            content = content.flatten()
    except DAMAGED as error:
        raise damaged(path, what, error) from error
    require_cells(path, content.num_rows * content.num_columns)
    return _table(path, content, _names(path, content), what)


def _table(path: Path, content: pa.Table, names: list[str], what: str) -> Table:
    require_columns(path, len(names))
    units = {
        f.name: f.metadata[UNIT_KEY].decode("utf-8", "replace")
        for f in content.schema
        if f.metadata and UNIT_KEY in f.metadata
    }
    units.update({f.name: "s" for f in content.schema if _is_time(f.type)})
    try:
        columns = {name: _column(content.column(number)) for number, name in enumerate(names)}
    except DAMAGED as error:
        raise damaged(path, what, error) from error
    return Table(path, columns, units, _metadata(content.schema.metadata or {}))


def _require_sizes(path: Path, metadata: pa.parquet.FileMetaData) -> None:
    """Refuse a file that says it holds more than one of its size can."""
    require_columns(path, metadata.num_columns)
    require_cells(path, metadata.num_rows * metadata.num_columns)


def _names(path: Path, content: pa.Table) -> list[str]:
    names: list[str] = content.column_names
    if repeated := sorted({name for name, count in Counter(names).items() if count > 1}):
        raise RecordingError(
            path, *(f"column {name} comes twice, expected every name once. Rename one." for name in repeated)
        )
    return names


def read_metadata(path: Path) -> dict[str, str]:
    """Read what a Parquet recording says of itself."""
    try:
        schema = pa.parquet.read_schema(path)
    except DAMAGED as error:
        raise damaged(path, "a whole Parquet file", error) from error
    return _metadata(schema.metadata or {})


def write(table: Table, path: Path) -> None:
    """Write a table as Parquet with checksums of its pages; units are metadata of the columns."""
    fields, arrays = [], []
    for name, column in table.columns.items():
        array = pa.array(column, type=pa.string() if column.dtype == object else None)
        unit = table.units.get(name)
        fields.append(pa.field(name, array.type, metadata=None if unit is None else {UNIT_KEY: unit.encode()}))
        arrays.append(array)
    schema = pa.schema(fields, metadata=dict(table.metadata) or None)
    pa.parquet.write_table(pa.Table.from_arrays(arrays, schema=schema), path, write_page_checksum=True)


def _metadata(raw: Mapping[bytes, bytes]) -> dict[str, str]:
    return {
        key.decode("utf-8", "replace"): value.decode("utf-8", "replace")
        for key, value in raw.items()
        if key not in FOREIGN_KEYS
    }


def _is_time(kind: pa.DataType) -> bool:
    return bool(pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _column(cells: pa.ChunkedArray) -> Column:
    """Turn a column into one of the four kinds; a null is NaN, in a text empty, a moment seconds since the first."""
    kind = cells.type
    if _is_time(kind):
        unit = "M8[ns]" if pa.types.is_timestamp(kind) else "m8[ns]"
        return column_of(np.asarray(cells.to_numpy()).astype(unit))
    is_whole = pa.types.is_integer(kind) or pa.types.is_boolean(kind)
    if pa.types.is_floating(kind) or pa.types.is_null(kind) or (is_whole and cells.null_count):
        return np.asarray(cells.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
    if is_whole:
        return as_column(np.asarray(cells.to_numpy()))
    return as_text(["" if cell is None else str(cell) for cell in cells.to_pylist()])
