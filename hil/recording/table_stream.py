"""A table through a pipe: a header in JSON, then the cells. Whoever reads it runs nothing, whatever comes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from hil.recording.kinds import Column, Kind, as_text
from hil.recording.table import Table

_LENGTH_BYTES: Final = 8

_DTYPES: Final[Mapping[Kind, type[np.generic]]] = {
    Kind.FLOAT: np.float64,
    Kind.INTEGER: np.int64,
    Kind.BOOLEAN: np.bool_,
}

Document = dict[str, Any]


def send(stream: IO[bytes], document: Document, columns: Mapping[str, Column] | None = None) -> None:
    """Write a document, and the columns it is about."""
    named = columns or {}
    kinds = [[name, Kind.of(column).value, int(column.size)] for name, column in named.items()]
    _send_text(stream, json.dumps({**document, "columns": kinds}))
    for column in named.values():
        if Kind.of(column) is Kind.TEXT:
            _send_text(stream, json.dumps(column.tolist()))
        else:
            stream.write(np.ascontiguousarray(column).data)
    stream.flush()


def receive(stream: IO[bytes]) -> tuple[Document, dict[str, Column]]:
    """Read what `send` has written."""
    document: Document = json.loads(_receive_text(stream))
    return document, {name: _column(stream, Kind(kind), size) for name, kind, size in document["columns"]}


def described(table: Table) -> Document:
    """Return all of a table but its columns and path."""
    return {
        "units": dict(table.units),
        "metadata": dict(table.metadata),
        "remarks": list(table.remarks),
        "master": table.master,
        "elsewhere": dict(table.elsewhere),
    }


def table_of(path: Path, document: Document, columns: Mapping[str, Column]) -> Table:
    """Return the table that `described` was made of."""
    return Table(
        path,
        columns,
        document["units"],
        document["metadata"],
        remarks=tuple(document["remarks"]),
        master=document["master"],
        elsewhere=document["elsewhere"],
    )


def _column(stream: IO[bytes], kind: Kind, size: int) -> Column:
    if kind is Kind.TEXT:
        return as_text(json.loads(_receive_text(stream)))
    column = np.empty(size, dtype=_DTYPES[kind])
    _fill(stream, column.data.cast("B"))
    return column


def _send_text(stream: IO[bytes], text: str) -> None:
    raw = text.encode("ascii")
    stream.write(len(raw).to_bytes(_LENGTH_BYTES, "little"))
    stream.write(raw)


def _receive_text(stream: IO[bytes]) -> str:
    length = bytearray(_LENGTH_BYTES)
    _fill(stream, memoryview(length))
    raw = bytearray(int.from_bytes(length, "little"))
    _fill(stream, memoryview(raw))
    return raw.decode("ascii")


def _fill(stream: IO[bytes], place: memoryview) -> None:
    done = 0
    while done < len(place):
        count = stream.readinto(place[done:])  # type: ignore[attr-defined]  # a buffered reader has it
        if not count:
            raise EOFError
        done += count
