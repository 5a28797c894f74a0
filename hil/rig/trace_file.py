"""Read a bus trace, by python-can's own readers, as data frames with their time; every fault by the file's name."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

import can
from can.io.blf import BLFParseError

from drivers.canopen.can_link import is_canopen
from hil.errors import RecordingError
from hil.rig.trace import require_trace_name

NS_PER_S = 1_000_000_000

_READING_ERRORS = (OSError, ValueError, IndexError, KeyError, EOFError, struct.error, zlib.error, BLFParseError)
"""What python-can's readers raise for a file that is damaged or of another format."""


_READERS: dict[str, Callable[..., Any]] = {
    ".blf": can.BLFReader,
    ".log": can.CanutilsLogReader,
    ".asc": can.ASCReader,
}


def read_frames(path: Path) -> Iterator[tuple[int, bytes, int]]:
    """Give identifier, data and time [ns] of every data frame with an 11-bit identifier, in the file's order.

    Raises
    ------
    RecordingError
        If the file can't be read to its end, or is no trace.
    """
    require_trace_name(path)
    if not path.is_file():
        raise RecordingError(path, "expected a bus trace to read, there is no such file")
    try:
        with _opened(path) as file, _READERS[path.suffix.lower()](file) as reader:
            for message in reader:
                if is_canopen(message):
                    yield message.arbitration_id, bytes(message.data), round(message.timestamp * NS_PER_S)
    except _READING_ERRORS as error:
        raise RecordingError(
            path,
            f"expected a bus trace in the format of its suffix, came: {error or type(error).__name__}. It is damaged, "
            "cut off, or of another format.",
        ) from error


def _opened(path: Path) -> IO[Any]:
    """Open a trace; a reader that opens it itself leaves it open where the file is at fault."""
    return path.open("rb") if path.suffix.lower() == ".blf" else path.open(encoding="utf-8")
