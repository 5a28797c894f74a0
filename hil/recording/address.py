"""Addresses of vectors inside structs and matrices, as ``hil look`` prints them and ``[signals]`` takes them.

``log.motor.speed`` is a field, ``data(:, 3)`` a column as MATLAB counts, from 1; ``data[:, 2]`` is the same one as
Python counts, from 0. A matrix with more columns than rows is taken by rows: ``data(3, :)``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from hil.recording.kinds import Column, is_column

MOST_SLICES: Final = 512
"""Columns of a matrix that have an address each."""

_SLICE: Final = re.compile(r"(?P<open>[\[(])\s*(?P<row>:|\d+)\s*,\s*(?P<column>:|\d+)\s*[\])]")


def canonical(address: str) -> str:
    """Return an address as it is listed: counted from 1, without blanks around its parts."""

    def counted(match: re.Match[str]) -> str:
        more = 1 if match["open"] == "[" else 0
        row, column = (part if part == ":" else str(int(part) + more) for part in (match["row"], match["column"]))
        return f"({row},{column})"

    return _SLICE.sub(counted, address.strip())


def vectors_of(name: str, values: Column) -> Iterator[tuple[str, Column]]:
    """Yield the vectors of an array with their addresses: the whole one, or a matrix's columns."""
    if not is_column(values) or values.size < 2:
        return
    if max(values.shape) == values.size:
        yield name, values.ravel()
    elif values.ndim == 2 and min(values.shape) <= MOST_SLICES:
        rows, columns = values.shape
        if rows >= columns:
            yield from ((f"{name}(:,{k + 1})", values[:, k]) for k in range(columns))
        else:
            yield from ((f"{name}({k + 1},:)", values[k, :]) for k in range(rows))


def under_names(vectors: Mapping[str, Column], wanted: Iterable[str]) -> dict[str, Column]:
    """Return vectors, those that are wanted by another spelling of their address under that one, too."""
    found = dict(vectors)
    found.update({name: vectors[canonical(name)] for name in wanted if canonical(name) in vectors})
    return found
