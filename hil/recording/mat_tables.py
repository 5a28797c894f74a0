"""MATLAB tables and timetables: objects that only the mat-io library takes apart, in the process that reads files."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from hil.errors import RecordingError
from hil.recording.damaged import damaged

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
