"""Read a bus trace, by python-can's own readers, as data frames with their time; every fault by the file's name.

A trace is that of one bus. Where a log has several channels one has to be chosen: merged, the frames of two buses
would be taken for those of one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

from drivers.canopen import can
from drivers.canopen.can_link import is_canopen
from hil.errors import RecordingError
from hil.rig.blf_file import BoundedBlfReader
from hil.rig.trace import READABLE, is_trace

NS_PER_S = 1_000_000_000

LATEST_S = float(1 << 33)
"""Times beyond are none of a clock [s]; in nanoseconds they would not fit into 64 bit."""

COUNTED_FROM_1 = (".blf", ".asc")
"""Formats whose channels python-can counts from 0, and their files and every other program from 1."""


class _TrcReader(can.TRCReader):
    """python-can's reader of PEAK's text log (1.0, 1.1, 1.3, 2.0, 2.1), which passes over a line that is cut short."""

    def _parse_line(self, line: str) -> can.Message | None:
        return self._parse_cols(tuple(line.split(maxsplit=self._num_columns)))


_READERS: dict[str, Callable[..., Any]] = {
    ".blf": BoundedBlfReader,
    ".log": can.CanutilsLogReader,
    ".asc": can.ASCReader,
    ".trc": _TrcReader,
}


def read_frames(path: Path, channel: str | None = None) -> Iterator[tuple[int, bytes, int]]:
    """Give identifier, data and time [ns] of every frame of CANopen's kind, in the file's order."""
    first, found = channel, channel is None
    for name, message in _frames(path):
        first = name if first is None else first
        if name == first:
            found = True
            yield message.arbitration_id, bytes(message.data), _time_ns(path, message.timestamp)
        elif channel is None:
            raise _which(path, "expected the traffic of one bus")
    if not found:
        raise _which(path, f"expected channel {channel!r}")


def _which(path: Path, expected: str) -> RecordingError:
    counts = Counter(name for name, _ in _frames(path))
    got = ", ".join(f"{name} ({count} frames)" for name, count in sorted(counts.items()))
    return RecordingError(
        path,
        f"{expected}, got channels {got or 'without a frame'}. Say which: --channel {next(iter(counts), 'NAME')}",
    )


def _frames(path: Path) -> Iterator[tuple[str, can.Message]]:
    """Give channel and frame; those of other protocols on the same wire are left out."""
    if not is_trace(path):
        raise RecordingError(path, f"expected a name that ends in one of {', '.join(READABLE)}, got {path.suffix!r}")
    if not path.is_file():
        raise RecordingError(path, "expected a bus trace to read, there is no such file")
    suffix = path.suffix.lower()
    try:
        with _opened(path) as file, _READERS[suffix](file) as reader:
            for message in reader:
                if is_canopen(message):
                    if len(message.data) != message.dlc:
                        raise ValueError(f"a frame of {message.dlc} bytes that has {len(message.data)}")
                    yield _channel(message, suffix), message
    except NotImplementedError as error:
        raise RecordingError(path, f"expected a version of {suffix} that python-can reads, got: {error}") from error
    except RecordingError:
        raise
    except Exception as error:  # python-can's readers raise anything on a file that is damaged
        raise RecordingError(
            path,
            f"expected a bus trace in the format of its suffix, got: {error or type(error).__name__}. It is damaged, "
            "cut off, or of another format.",
        ) from error


def _channel(message: can.Message, suffix: str) -> str:
    channel = message.channel
    return str(channel + 1) if suffix in COUNTED_FROM_1 and isinstance(channel, int) else str(channel)


def _time_ns(path: Path, timestamp_s: float) -> int:
    if not abs(timestamp_s) < LATEST_S:
        raise RecordingError(path, f"expected frames with the time of a clock, got {timestamp_s:g} s. It is damaged.")
    return round(timestamp_s * NS_PER_S)


def _opened(path: Path) -> IO[Any]:
    """Open a trace; a reader that opens it itself leaves it open where the file is at fault."""
    if path.suffix.lower() == ".blf":
        return path.open("rb")
    return path.open(encoding="utf-8", errors="replace")  # comments and names may be of another code page
