"""Read a bus trace, by python-can's own readers, as data frames with their time; every fault by the file's name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

import can

from hil.errors import RecordingError
from hil.rig.blf_file import BoundedBlfReader
from hil.rig.trace import require_trace_name

NS_PER_S = 1_000_000_000

LATEST_S = float(1 << 33)
"""Times beyond are none of a clock [s]; in nanoseconds they would not fit into 64 bit."""

_READERS: dict[str, Callable[..., Any]] = {
    ".blf": BoundedBlfReader,
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
                if not (message.is_error_frame or message.is_remote_frame or message.is_extended_id):
                    yield message.arbitration_id, bytes(message.data), _time_ns(path, message.timestamp)
    except RecordingError:
        raise
    except Exception as error:  # python-can's readers raise anything on a file that is damaged
        raise RecordingError(
            path,
            f"expected a bus trace in the format of its suffix, came: {error or type(error).__name__}. It is damaged, "
            "cut off, or of another format.",
        ) from error


def _time_ns(path: Path, timestamp_s: float) -> int:
    if not abs(timestamp_s) < LATEST_S:
        raise RecordingError(path, f"expected frames with the time of a clock, came {timestamp_s:g} s. It is damaged.")
    return round(timestamp_s * NS_PER_S)


def _opened(path: Path) -> IO[Any]:
    """Open a trace; a reader that opens it itself leaves it open where the file is at fault."""
    return path.open("rb") if path.suffix.lower() == ".blf" else path.open(encoding="utf-8")
