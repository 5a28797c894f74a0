"""A bus trace: every frame of a run's bus, recorded next to its samples by python-can's own writers, and read back.

The cycle only puts a frame into a queue; a thread of its own writes, twenty times a second. The times are those of
the samples: the host's monotonic clock, stamped once, shifted to the time of day at which the trace began.

What is read are data frames with their time; every fault by the file's name. A trace is that of one bus. Where a log
has several channels one has to be chosen: merged, the frames of two buses would be taken for those of one.

python-can's reader of Vector's BLF trusts every length in the file: here each is checked before it is used. A BLF is a
row of containers, each a part of the log packed by zlib; an object may continue in the next container. One megabyte of
them can unpack to gigabytes, and an object of length 0 is one that a reader never leaves.
"""

from __future__ import annotations

import threading
import time
import zlib
from collections import Counter, deque
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, Any, BinaryIO, Final, Self

from drivers.canopen import can
from drivers.canopen.can_link import is_canopen
from drivers.foreign_file import open_regular, open_regular_text
from hil.errors import RecordingError
from hil.recording.bounds import no_room

blf = can.io.blf
"""Not imported before `drivers.canopen`, see there."""

SUFFIXES = (".blf", ".log", ".asc")
"""Vector's binary and text logs, and the text of Linux's candump: what ``can.Logger`` writes by these names."""

READABLE = (*SUFFIXES, ".trc")
"""What can be read: PEAK's text log too, whose times are whole microseconds at best."""

WRITE_EVERY_S = 0.05

MOST_WAITING = 200_000
"""Frames that may wait for the disk: over a minute of a full bus at 500 kbit/s."""

NS_PER_S = 1_000_000_000

CONTAINER_BYTES: Final = 16 << 20
"""A container holds 128 KiB in files of Vector and of python-can."""

FLOOR_BYTES: Final = 32 << 20
UNPACKED_PER_BYTE: Final = 64
"""What a whole file may unpack to: a floor, and for large files a multiple of their size; frames pack tenfold."""

HEADER_BYTES: Final = blf.OBJ_HEADER_BASE_STRUCT.size

LATEST_S = float(1 << 33)
"""Times beyond are none of a clock [s]; in nanoseconds they would not fit into 64 bit."""

COUNTED_FROM_1 = (".blf", ".asc")
"""Formats whose channels python-can counts from 0, and their files and every other program from 1."""


class BusTrace:
    """A trace file, from `__enter__` to `__exit__`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._frames: deque[tuple[can.Message, int]] = deque()
        self._ending = threading.Event()
        self._failed: OSError | None = None
        self._thread = threading.Thread(target=self._write_on, name="bus trace", daemon=True)
        self._shift_ns = time.time_ns() - time.monotonic_ns()

    def __enter__(self) -> Self:
        require_trace_name(self.path)
        if self.path.exists():
            raise RecordingError(self.path, "expected a new name, got one that exists: a trace is never overwritten.")
        try:
            self._writer = can.Logger(self.path)
        except OSError as error:
            raise RecordingError(self.path, f"expected a place to write, got: {error.strerror or error}") from error
        self._thread.start()
        return self

    def take(self, message: can.Message, t_ns: int) -> None:
        """Take one frame, sent or received at ``t_ns`` of the monotonic clock; it belongs to the trace from now on."""
        if len(self._frames) < MOST_WAITING:
            self._frames.append((message, t_ns))
        elif self._failed is None:
            self._failed = OSError(f"{MOST_WAITING} frames wait for the disk")

    def raise_if_failed(self) -> None:
        """Tell that the disk does not take the frames."""
        if self._failed is not None:
            raise no_room(self.path, "the bus trace", self._failed, "Make room and run again.") from self._failed

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        self._thread.join()
        try:
            self._writer.stop()
        except OSError as cause:
            self._failed = self._failed or cause
        if error is None:  # what ended the run matters more than its trace
            self.raise_if_failed()

    def _write_on(self) -> None:
        try:
            while not self._ending.wait(WRITE_EVERY_S):
                self._write_all()
            self._write_all()
        except OSError as error:
            self._failed = error
            self._frames = deque(maxlen=0)  # keeps nothing any more

    def _write_all(self) -> None:
        while self._frames:
            message, t_ns = self._frames.popleft()
            message.timestamp = (t_ns + self._shift_ns) / NS_PER_S
            message.channel = None  # one bus: its name here is this program's own affair
            self._writer.on_message_received(message)


def is_trace(path: Path) -> bool:
    """Tell a bus trace from a recording, by its suffix."""
    return path.suffix.lower() in READABLE


def require_trace_name(path: Path) -> None:
    """Refuse a name no trace that is written can have."""
    if path.suffix.lower() not in SUFFIXES:
        raise RecordingError(path, f"expected a name that ends in one of {', '.join(SUFFIXES)}, got {path.suffix!r}")


class BoundedBlfReader(can.BLFReader):
    """Gives the frames of a BLF."""

    def __init__(self, file: BinaryIO, **kwargs: Any) -> None:
        file.seek(0, 2)
        self._left = max(FLOOR_BYTES, UNPACKED_PER_BYTE * file.tell())
        file.seek(0)
        super().__init__(file, **kwargs)

    def __iter__(self) -> Iterator[can.Message]:  # type: ignore[override]  # nothing is sent into it
        while header := self.file.read(HEADER_BYTES):
            signature, _, _, size, kind = blf.OBJ_HEADER_BASE_STRUCT.unpack(header)
            if signature != b"LOBJ" or size < HEADER_BYTES:
                raise blf.BLFParseError(f"expected an object, got {signature!r} of {size} bytes")
            content = self.file.read(size - HEADER_BYTES)
            self.file.read(size % 4)
            if kind == blf.LOG_CONTAINER:
                yield from self._parse_container(self._unpacked(content))
        self.stop()

    def _unpacked(self, content: bytes) -> bytes:
        method, _ = blf.LOG_CONTAINER_STRUCT.unpack_from(content)
        packed = content[blf.LOG_CONTAINER_STRUCT.size :]
        if method == blf.NO_COMPRESSION:
            data = packed
        elif method == blf.ZLIB_DEFLATE:
            unpacking = zlib.decompressobj()
            data = unpacking.decompress(packed, CONTAINER_BYTES)
            if unpacking.unconsumed_tail:
                raise blf.BLFParseError(f"expected containers of at most {CONTAINER_BYTES} bytes, got a larger one")
        else:
            raise blf.BLFParseError(f"expected a container packed by zlib or not at all, got method {method}")
        self._left -= len(data)
        if self._left < 0:
            raise blf.BLFParseError("expected a log, got a file that unpacks to far more than one of its size")
        return data

    def _parse_container(self, data: bytes) -> Iterator[can.Message]:
        if len(self._tail) > CONTAINER_BYTES:
            raise blf.BLFParseError("expected objects that end, got one that is longer than any")
        _require_lengths(self._tail + data)
        yield from super()._parse_container(data)


def _require_lengths(data: bytes) -> None:
    """See that every object whose header is there leads on to the next."""
    at = data.find(b"LOBJ", 0, 8)
    while 0 <= at <= len(data) - HEADER_BYTES:
        size = blf.OBJ_HEADER_BASE_STRUCT.unpack_from(data, at)[3]
        if size < HEADER_BYTES:
            raise blf.BLFParseError(f"expected an object of {HEADER_BYTES} bytes or more, got one of {size}")
        at = data.find(b"LOBJ", at + size, at + size + 8)


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
        return open_regular(path)
    return open_regular_text(path, errors="replace")  # comments and names may be of another code page
