"""The recording formats, by file name suffix. A new one is a file with ``read`` and ``write`` and a line."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from hil.errors import RecordingError
from hil.recording import csv_format, mat_format, parquet_format
from hil.recording.format_hints import FormatHints
from hil.recording.sidecar import read_sidecar
from hil.recording.table import Table


@dataclass(frozen=True, slots=True)
class Format:
    """How one kind of file is read and written.

    ``write`` is None for a format that is only read, ``metadata`` for one whose metadata come with the table alone.
    """

    read: Callable[[Path, FormatHints], Table]
    write: Callable[[Table, Path], None] | None
    metadata: Callable[[Path], Mapping[str, str]] | None = None


FORMATS: Mapping[str, Format] = MappingProxyType(
    {
        ".csv": Format(csv_format.read, csv_format.write, read_sidecar),
        ".parquet": Format(parquet_format.read, parquet_format.write, parquet_format.read_metadata),
        ".mat": Format(mat_format.read, None),
    }
)


def read_table(path: Path | str, hints: FormatHints | None = None) -> Table:
    """Read a recording of any known format.

    Raises
    ------
    RecordingError
        If the file can't be opened, its suffix is unknown, or its content is at fault.
    """
    path = Path(path)
    known = FORMATS.get(path.suffix.lower())
    if known is None:
        raise RecordingError(path, f"expected a recording ({', '.join(FORMATS)}), came {path.suffix!r}")
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise RecordingError(path, f"expected a readable file, came: {error.strerror}") from error
    return known.read(path, hints or FormatHints())


def read_metadata(path: Path | str) -> Mapping[str, str]:
    """Read what a recording says of itself, without its rows where the format allows.

    Raises
    ------
    RecordingError
        As `read_table`.
    """
    path = Path(path)
    known = FORMATS.get(path.suffix.lower())
    if known is None or known.metadata is None or not path.is_file():
        return read_table(path).metadata
    return known.metadata(path)


def writer_for(path: Path) -> Callable[[Table, Path], None]:
    """Return what writes a new recording of that name.

    Raises
    ------
    RecordingError
        If the suffix is not one that can be written, the file is there already, or its folder is not.
    """
    known = FORMATS.get(path.suffix.lower())
    if known is None or known.write is None:
        writable = ", ".join(suffix for suffix, form in FORMATS.items() if form.write)
        raise RecordingError(path, f"expected a name that ends in one of {writable}, came {path.suffix!r}")
    if path.exists():
        raise RecordingError(
            path, "expected a new name, came one that exists: a recording is never overwritten. Move it away."
        )
    if not path.parent.is_dir():
        raise RecordingError(path, f"expected an existing folder, came {path.parent}. Make it first.")
    return known.write


def write_table(table: Table, path: Path | str) -> None:
    """Write a new recording, whole or not at all.

    Raises
    ------
    RecordingError
        As :func:`writer_for`, or if the format can't hold the content.
    """
    path = Path(path)
    write = writer_for(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(table, part)
        part.rename(path)
    finally:
        part.unlink(missing_ok=True)
