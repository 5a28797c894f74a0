"""Variables of a .mat file: structs, cells, tables and timetables as vectors by address, scalars, and the rest."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from hil.errors import RecordingError
from hil.recording.bounds import damaged
from hil.recording.request import vectors_of
from hil.recording.table import Column

OBJECTS: Final = "__function_workspace__"
"""Variable in which MATLAB keeps what its objects hold (versions 5 to 7)."""

NS: Final = 1e-9


def with_tables(path: Path) -> dict[str, Any]:
    """Return the variables of a .mat file, tables among them as data frames."""
    from matio import load_from_mat

    try:
        variables: dict[str, Any] = load_from_mat(str(path))
    except Exception as error:  # the library raises anything on what it does not know
        raise damaged(path, "a whole .mat file", error) from error
    return variables


def with_tables_if_possible(path: Path, variables: dict[str, Any]) -> dict[str, Any]:
    """Return the variables of a .mat file with its tables, where there are objects that the library can read."""
    if OBJECTS not in variables:
        return variables
    try:
        return with_tables(path)
    except RecordingError:  # objects of other classes; what is none of them is read all the same
        return variables


def is_table(value: Any) -> bool:
    """Whether a variable is a table."""
    return hasattr(value, "columns") and hasattr(value, "index")


def columns_of(table: Any) -> dict[str, Any]:
    """Return the columns of a table, of a timetable its times first; times in seconds."""
    columns = {str(name): _seconds(table[name].to_numpy()) for name in table.columns}
    if table.index.dtype.kind not in "mM":
        return columns
    return {str(table.index.name or "Time"): _seconds(table.index.to_numpy()), **columns}


def _seconds(values: Any) -> Any:
    """Return durations in seconds, times as seconds since the first; anything else as it is."""
    if values.dtype.kind == "m":
        return values.astype("timedelta64[ns]").astype(np.int64) * NS
    if values.dtype.kind == "M":
        stamps = values.astype("datetime64[ns]").astype(np.int64)
        return (stamps - stamps[:1]) * NS
    return values


DEEPEST: Final = 12
"""Structs inside structs that are looked into."""


def walk(
    name: str, value: Any, vectors: dict[str, Column], scalars: dict[str, str], other: list[str], depth: int = 0
) -> None:
    """Put what is in a variable where it belongs."""
    if is_table(value):
        fields = columns_of(value)
    elif hasattr(value, "_fieldnames"):
        fields = {field: getattr(value, field) for field in value._fieldnames}  # noqa: SLF001 - scipy's way to them
    elif isinstance(value, np.ndarray) and value.dtype.names is not None:
        fields = {field: value[field] for field in value.dtype.names}
    elif isinstance(value, dict):
        fields = value
    elif isinstance(value, np.ndarray) and value.dtype == object:
        parts = value.ravel(order="F").tolist()
        fields = {f"({k + 1})" if len(parts) > 1 else "": part for k, part in enumerate(parts)}
    else:
        _sort(name, np.asarray(value), vectors, scalars, other)
        return
    if depth >= DEEPEST or (isinstance(value, np.ndarray) and value.size > 64):
        other.append(name)
        return
    for key, part in fields.items():
        inside = name + key if not key or key.startswith("(") else f"{name}.{key}"
        walk(inside, part, vectors, scalars, other, depth + 1)


def _sort(name: str, array: Column, vectors: dict[str, Column], scalars: dict[str, str], other: list[str]) -> None:
    if array.dtype.kind in "fiub" and array.size == 1:
        scalars[name] = repr(array.item())
        return
    found = dict(vectors_of(name, array)) if array.dtype.kind in "fiub" else {}
    vectors.update(found)
    if not found:
        other.append(name)
