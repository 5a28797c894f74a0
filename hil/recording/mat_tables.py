"""MATLAB tables and timetables: objects that only the mat-io library takes apart, in the process that reads files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hil.recording.damaged import damaged


def with_tables(path: Path) -> dict[str, Any]:
    """Return the variables of a .mat file; a table is a mapping of its columns, times are in seconds.

    Raises
    ------
    RecordingError
        If the file is damaged.
    """
    from matio import load_from_mat

    try:
        variables = load_from_mat(str(path))
    except Exception as error:  # the library raises anything on what it does not know
        raise damaged(path, "a whole .mat file", error) from error
    return {name: _plain(value) for name, value in variables.items()}


def _plain(value: Any) -> Any:
    """Return a value with every table in it as a mapping of columns."""
    if hasattr(value, "columns") and hasattr(value, "index"):
        table = {str(name): _seconds(value[name].to_numpy()) for name in value.columns}
        if value.index.dtype.kind in "mM":
            table = {str(value.index.name or "Time"): _seconds(value.index.to_numpy()), **table}
        return table
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    return value


def _seconds(values: Any) -> Any:
    """Return times as seconds since the first, durations as seconds; anything else as it is."""
    if values.dtype.kind == "m":
        return values.astype("timedelta64[ns]").astype(np.int64) * 1e-9
    if values.dtype.kind == "M":
        stamps = values.astype("datetime64[ns]").astype(np.int64)
        return (stamps - stamps[:1]) * 1e-9
    return values
