"""What the tool may see of a real recording, written where nothing else is.

A recording is checked against its sum, cut to its rows and to the channels that are shown, and written as plain CSV.
Numbers come out as they went in, to the last bit.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from estimator.signals.record import BoolArray
from hil.proof.real.case_file import CaseFile, RealFileError, RecordingEntry
from hil.recording.formats import read_table
from hil.recording.publish import write_table
from hil.recording.request import Request
from hil.recording.table import Column, Table


def sha256_of(path: Path) -> str:
    """Return the checksum of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def require_recording(data: Path, entry: RecordingEntry) -> Path:
    """Return the path of a recording that is there and is the one that was meant.

    Raises
    ------
    RealFileError
        If it is not.
    """
    path = data / entry.path
    if not path.is_file():
        raise RealFileError(
            path,
            "expected a recording, got nothing. Fetch it with python -m hil.proof.real.download "
            f"--to {data}, or from {entry.origin.page}",
        )
    got = sha256_of(path)
    if got != entry.sha256:
        raise RealFileError(
            path, f"expected the SHA-256 {entry.sha256}, got {got}. Fetch it again, or name the new one"
        )
    return path


def full_table(case: CaseFile, name: str, data: Path) -> Table:
    """Return a recording with all its channels, cut to its rows.

    Raises
    ------
    RealFileError
        If the recording is not there or not the one that was meant.
    """
    entry = case.recordings[name]
    table = read_table(require_recording(data, entry), Request(case.format))
    rows = slice(None) if entry.rows is None else slice(*entry.rows)
    return Table(table.path, {column: values[rows] for column, values in table.columns.items()})


def write_shown(case: CaseFile, name: str, data: Path, place: Path, hide: dict[str, BoolArray] | None = None) -> Path:
    """Write what is shown of a recording as ``place/NAME.csv``.

    Parameters
    ----------
    hide
        Channel to the samples of it that are left empty, shape (N,).

    Raises
    ------
    RealFileError
        If a channel that is to be shown is not there.
    """
    table = full_table(case, name, data)
    missing = [column for column in case.shown if column not in table.columns]
    if missing:
        raise RealFileError(table.path, f"expected the channels {missing}, got {', '.join(table.columns)}")
    columns: dict[str, Column] = {column: table.columns[column] for column in case.shown}
    for column, rows in (hide or {}).items():
        columns[column] = np.where(rows, np.nan, columns[column].astype(np.float64))
    path = place / f"{name}.csv"
    write_table(Table(path, columns), path, replace=True)
    return path
