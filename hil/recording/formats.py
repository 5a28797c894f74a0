"""The recording formats, by file name suffix. A new one is a file with ``read`` and ``write`` and a line.

Writing is in `hil.recording.publish`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path, PurePath
from types import MappingProxyType
from typing import Any

from drivers.foreign_file import open_regular
from hil.errors import RecordingError
from hil.recording.channels import understood
from hil.recording.checksum import CHECKSUM, require_whole
from hil.recording.description import read_sidecar_metadata, sidecar_of
from hil.recording.request import Request
from hil.recording.sandbox import READER
from hil.recording.table import Table

TEXT_BYTES = 4096  # of a file, by which it is seen to be text


@dataclass(frozen=True, slots=True)
class Format:
    """How one kind of file is read and written.

    ``write`` is None for a format that is only read, ``metadata`` for one whose metadata come with the table alone.
    ``companion`` names the file that belongs to a recording in a format that has no place for all there is to say.
    ``tables`` reads a table for each time of a format that may have several.
    ``is_sandboxed`` is True where a compiled library parses it: in a process of its own (`hil.recording.sandbox`).
    """

    read: Callable[[Path, Request], Table]  # a table for one time; `RecordingError` where the file is damaged
    write: Callable[[Table, Path], None] | None = None
    metadata: Callable[[Path], Mapping[str, str]] | None = None
    companion: Callable[[Path], Path] | None = None
    is_sandboxed: bool = True
    tables: Callable[[Path, Request], list[Table]] | None = None


def _of(name: str) -> Callable[..., Any]:
    """Return a function of a format's module, which is imported with the first call: its library takes time."""
    module, _, function = name.partition(".")

    def called(*arguments: object) -> Any:
        return getattr(import_module(f"hil.recording.{module}"), function)(*arguments)

    return called


_TEXT = partial(Format, _of("csv_format.read"), is_sandboxed=False)
_DESCRIBED_TEXT = partial(_TEXT, metadata=read_sidecar_metadata, companion=sidecar_of)
_MDF = partial(
    Format, _of("mdf_format.read"), metadata=_of("mdf_format.read_metadata"), tables=_of("mdf_format.read_all")
)
_HDF5 = Format(_of("hdf5_format.read"), _of("hdf5_format.write"), _of("hdf5_format.read_metadata"))
_NUMPY = Format(_of("array_formats.read_numpy"))
_MEASURED = Format(_of("measurement_formats.read"), tables=_of("measurement_formats.read_all"))

FORMATS: Mapping[str, Format] = MappingProxyType(
    {
        ".csv": _DESCRIBED_TEXT(_of("csv_format.write")),
        ".txt": _DESCRIBED_TEXT(),
        ".tsv": _DESCRIBED_TEXT(),
        ".ascii": _TEXT(),
        ".lvm": _TEXT(),
        ".gz": Format(_of("csv_format.read_packed")),
        ".parquet": Format(
            _of("parquet_format.read"), _of("parquet_format.write"), _of("parquet_format.read_metadata")
        ),
        ".mf4": _MDF(_of("mdf_format.write")),
        ".mdf": _MDF(),
        ".dat": _MDF(),
        ".h5": _HDF5,
        ".hdf5": _HDF5,
        **dict.fromkeys((".feather", ".arrow"), Format(_of("parquet_format.read_feather"))),
        ".jsonl": Format(_of("parquet_format.read_json_lines")),
        ".npz": _NUMPY,
        ".npy": _NUMPY,
        ".xlsx": Format(_of("array_formats.read_xlsx")),
        ".ods": Format(_of("array_formats.read_ods")),
        ".json": Format(_of("wpilib_formats.sysid")),
        ".wpilog": Format(_of("wpilib_formats.read"), tables=_of("wpilib_formats.read_all")),
        **dict.fromkeys((".tdms", ".mcap", ".blf", ".asc", ".log", ".trc"), _MEASURED),
        ".mat": Format(_of("mat_format.read"), _of("mat_format.write"), _of("mat_format.read_metadata")),
    }
)


def read_table(path: Path | str, request: Request | None = None) -> Table:
    """Read a recording of any known format.

    Raises
    ------
    RecordingError
        If the file can't be opened, its suffix is unknown, its content is at fault, or not what its checksum says.
    """
    path = Path(path)
    known = format_of(path)
    asked = request or Request()
    table = READER.table(path, asked) if known.is_sandboxed else tables_of(known, path, asked)[0]
    require_whole(table)
    return table


def tables_of(known: Format, path: Path, request: Request, every: bool = False) -> list[Table]:
    """Read the table of a file, or ``every`` one it has, in this process; what the columns mean is understood."""
    tables = known.tables(path, request) if every and known.tables is not None else [known.read(path, request)]
    return [table if CHECKSUM in table.metadata else understood(table) for table in tables]


def read_metadata(path: Path | str) -> Mapping[str, str]:
    """Read what a recording says of itself, without its rows where the format allows."""
    path = Path(path)
    known = format_of(path)
    return READER.metadata(path) if known.is_sandboxed else metadata_of(known, path)


def metadata_of(known: Format, path: Path) -> Mapping[str, str]:
    """Read what a recording of a format says of itself, in this process."""
    return known.read(path, Request()).metadata if known.metadata is None else known.metadata(path)


def writer_for(path: Path, replace: bool = False) -> Callable[[Table, Path], None]:
    """Return what writes a recording of that name, a new one unless it may replace another."""
    known = FORMATS.get(path.suffix.lower())
    if known is None or known.write is None:
        writable = ", ".join(suffix for suffix, form in FORMATS.items() if form.write)
        raise RecordingError(path, f"expected a name that ends in one of {writable}, got {path.suffix!r}")
    if not replace:
        _require_new(path, known)
    elif path.is_dir():
        raise RecordingError(path, "expected the name of a recording, got a folder. Choose another name.")
    if not path.parent.is_dir():
        raise RecordingError(path, f"expected an existing folder, got {path.parent}. Make it first.")
    return known.write


def is_named_as_recording(path: PurePath) -> bool:
    """Tell whether a file in a folder is a recording by its name: run.csv is, its sidecar run.csv.json is not."""
    suffix, inner = path.suffix.lower(), PurePath(path.stem).suffix.lower()
    return suffix in FORMATS and not (suffix == ".json" and inner in FORMATS)


def format_of(path: Path) -> Format:
    """Return the format of a file that is there and can be read."""
    known = FORMATS.get(path.suffix.lower())
    if known is None:
        raise RecordingError(path, f"expected a recording, got {path.suffix or 'no ending'!r}. {_way_out(path)}")
    _require_readable(path)
    return known


def _way_out(path: Path) -> str:
    """Say how a file of an unknown format gets in."""
    try:
        with open_regular(path) as file:
            start = file.read(TEXT_BYTES)
    except OSError:
        start = b""
    if start and b"\0" not in start and any(mark in start for mark in b",;\t "):
        return "It looks like text: copy it to a name that ends in .csv, and let hil look read it."
    return (
        "Save it as CSV, Parquet or MDF 4 where it was recorded: most programs can. Which formats are read as they "
        "are, and how the usual loggers write them, is in docs/from-your-logger.md."
    )


def _require_readable(path: Path) -> None:
    try:
        open_regular(path).close()  # libraries open the name themselves
    except OSError as error:
        raise RecordingError(path, f"expected a readable file, got: {error.strerror}") from error


def _require_new(path: Path, known: Format) -> None:
    try:
        if path.exists():
            raise RecordingError(
                path, "expected a new name, got one that exists: a recording is never overwritten. Move it away."
            )
        if known.companion is not None and (companion := known.companion(path)).exists():
            raise RecordingError(
                companion, "expected a new name, got one that exists: it describes another recording. Move it away."
            )
    except OSError as error:
        raise RecordingError(path, f"expected a place to write, got: {error.strerror or error}") from error
