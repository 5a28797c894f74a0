"""Processes that work on what others made, recordings and FMUs: what that does to them ends there.

Requests and answers go through pipes, a header in JSON, then columns of cells: whoever reads them runs nothing.
"""

from __future__ import annotations

import atexit
import io
import json
import math
import os
import queue
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from subprocess import DEVNULL, PIPE
from typing import IO, Any, Final, Literal

import numpy as np

from hil.child import Pipe, end, environment, python, start
from hil.errors import RecordingError
from hil.recording.bounds import memory_bytes, processor_s
from hil.recording.request import Request
from hil.recording.survey import Survey
from hil.recording.table import Column, ColumnKind, Table, as_text

_LENGTH_BYTES: Final = 8

_DTYPES: Final[Mapping[ColumnKind, type[np.generic]]] = {
    ColumnKind.FLOAT: np.float64,
    ColumnKind.INTEGER: np.int64,
    ColumnKind.BOOLEAN: np.bool_,
}

Document = dict[str, Any]

_SAID: Final = ("units", "metadata", "remarks", "master", "elsewhere")
"""All of a table but its columns and path."""

TRIES: Final = 20  # attempts to remove the folder of a process whose command has ended

PROCESS: Final = "hil.recording.reader_process"

WAITING: Final = 6.0
"""How much longer than its processor's time a reading may last, on a machine that does other things."""

ENDING_S: Final = 5.0  # how long a process may take to end by itself

ENVIRONMENT: Final = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "2",
    "ARROW_DEFAULT_MEMORY_POOL": "system",
}
"""Threads and allocators that reserve address space, which is what is bounded, are left out."""


def send(stream: IO[bytes], document: Document, columns: Mapping[str, Column] | None = None) -> None:
    """Write a document, and the columns it is about."""
    named = columns or {}
    kinds = [[name, ColumnKind.of(column).value, int(column.size)] for name, column in named.items()]
    _send_text(stream, json.dumps({**document, "columns": kinds}))
    for column in named.values():
        if ColumnKind.of(column) is ColumnKind.TEXT:
            _send_text(stream, json.dumps(column.tolist()))
        else:
            stream.write(np.ascontiguousarray(column).data)
    stream.flush()


def receive(stream: IO[bytes]) -> tuple[Document, dict[str, Column]]:
    """Read what `send` has written."""
    document: Document = json.loads(_receive_text(stream))
    return document, {name: _column(stream, ColumnKind(kind), size) for name, kind, size in document["columns"]}


def described(table: Table) -> Document:
    """Return all of a table but its columns and path, as JSON has it."""
    return {name: getattr(table, name) for name in _SAID}


def table_of(path: Path, document: Document, columns: Mapping[str, Column]) -> Table:
    """Return the table that `described` was made of."""
    said = {name: document[name] for name in _SAID}
    return Table(path, columns, **{**said, "remarks": tuple(said["remarks"])})


def _column(stream: IO[bytes], kind: ColumnKind, size: int) -> Column:
    if kind is ColumnKind.TEXT:
        return as_text(json.loads(_receive_text(stream)))
    column = np.empty(size, dtype=_DTYPES[kind])
    _fill(stream, column.data.cast("B"))
    return column


def _send_text(stream: IO[bytes], text: str) -> None:
    raw = text.encode("ascii")
    stream.write(len(raw).to_bytes(_LENGTH_BYTES, "little"))
    stream.write(raw)


def _receive_text(stream: IO[bytes]) -> str:
    length = bytearray(_LENGTH_BYTES)
    _fill(stream, memoryview(length))
    raw = bytearray(int.from_bytes(length, "little"))
    _fill(stream, memoryview(raw))
    return raw.decode("ascii")


def _fill(stream: IO[bytes], place: memoryview) -> None:
    done = 0
    while done < len(place):
        count = stream.readinto(place[done:])  # type: ignore[attr-defined]  # a buffered reader has it
        if not count:
            raise EOFError
        done += count


Answer = Callable[[Document, dict[str, Column]], tuple[Document, Mapping[str, Column] | None]]


def serve(answer: Answer) -> None:
    """Answer requests on standard input in this process, until that ends: then it ends at once, whatever it is doing.

    Whoever asks may be killed at any time, and what is worked on may never return: a thread of its own sees it, and
    removes the folder of this process, which nobody else would.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever asks, and ends this process by its input
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # libraries print
    requests: queue.SimpleQueue[tuple[Document, dict[str, Column]]] = queue.SimpleQueue()
    stream, folder = os.fdopen(os.dup(sys.stdin.fileno()), "rb"), os.getcwd()

    def read() -> None:
        try:
            while True:
                requests.put(receive(stream))
        except (EOFError, OSError):
            for _ in range(TRIES):  # what is being unpacked meanwhile comes in its way
                shutil.rmtree(folder, ignore_errors=True)
                if not os.path.exists(folder):
                    break
            if hasattr(os, "killpg"):
                os.killpg(0, signal.SIGKILL)  # with what was started here
            os._exit(0)

    threading.Thread(target=read, name="requests", daemon=True).start()
    while True:
        send(answers, *answer(*requests.get()))


def limit(memory: int, processor: float | None = None, file_bytes: int | None = None) -> None:
    """Bound what this process takes from now on, where the system can; whoever asks does not wait longer anyway."""
    try:
        import resource
    except ImportError:
        return
    _lower(resource.RLIMIT_CORE, 0)
    _lower(resource.RLIMIT_AS, _address_space() + memory)
    if processor is not None:
        _lower(resource.RLIMIT_CPU, math.ceil(time.process_time() + processor))
    if file_bytes is not None:
        _lower(resource.RLIMIT_FSIZE, file_bytes)


def _lower(which: int, most_now: int) -> None:
    """Set what is allowed from now on, inside what the system allows at all."""
    import resource

    _, most = resource.getrlimit(which)
    resource.setrlimit(which, (most_now if most == resource.RLIM_INFINITY else min(most_now, most), most))


def _address_space() -> int:
    """Return what this process has of it, its libraries included [byte]; 1 GiB where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError, IndexError):
        return 1 << 30
    return pages * os.sysconf("SC_PAGE_SIZE")


ReadPart = Literal["table", "metadata", "survey"]


class Gone(Exception):
    """The process has ended before it answered."""


class Sandbox:
    """One process that works on what others made, with its pipes and its empty folder."""

    def __init__(self, module: str) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="hil-sandbox-", ignore_cleanup_errors=True)
        self._process = start(
            python("-m", module),
            cwd=self._folder.name,
            env=environment(**ENVIRONMENT),
            stdin=PIPE,
            stdout=PIPE,
            stderr=DEVNULL,
            bufsize=0,
        )
        self._ends = [Pipe(stream, self._process) for stream in (self._process.stdin, self._process.stdout) if stream]
        self._requests, self._answers = io.BufferedWriter(self._ends[0]), io.BufferedReader(self._ends[1])

    def ask(
        self, request: Document, limit_s: float, columns: Mapping[str, Column] | None = None
    ) -> tuple[Document, dict[str, Column]]:
        """Have a request answered; raises `Gone` where the process ends, or does not answer in time."""
        for pipe in self._ends:
            pipe.limit_at_s = time.monotonic() + limit_s
        try:
            send(self._requests, request, columns)
            return receive(self._answers)
        except (OSError, EOFError, ValueError, MemoryError, KeyError, TypeError) as error:  # also what is no answer
            raise Gone from error

    def end(self, at_once: bool = True) -> int:
        """End it, and return the status it ended with; one that is ending by itself is waited for."""
        status = end(self._process, 0.0 if at_once else ENDING_S)  # how it ends by itself tells why
        self._folder.cleanup()
        return status


class Reader:
    """Reads recordings in a process of its own, one after the other."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: Sandbox | None = None

    def table(self, path: Path, request: Request) -> Table:
        """Read a table; `RecordingError` also where the file ends its reader, or takes too long."""
        document, columns = self._read(path, "table", request)
        return table_of(path, document, columns)

    def metadata(self, path: Path) -> Mapping[str, str]:
        """Read what a recording says of itself; errors as of `table`."""
        said: Mapping[str, str] = self._read(path, "metadata", Request())[0]["metadata"]
        return said

    def survey(self, path: Path, request: Request) -> Survey:
        """Return every channel in figures; errors as of `table`."""
        return Survey.of_document(self._read(path, "survey", request)[0]["survey"])

    def end(self) -> None:
        """End the process, if there is one."""
        with self._lock:
            self._end()

    def _read(self, path: Path, what: ReadPart, request: Request) -> tuple[Document, dict[str, Column]]:
        size = path.stat().st_size
        with self._lock:
            self._process = process = self._process or Sandbox(PROCESS)
            asked = {"path": str(path.absolute()), "what": what, "request": request.as_document()}
            try:
                document, columns = process.ask(asked, WAITING * processor_s(size))
            except Gone:
                raise RecordingError(path, _why(self._end(at_once=False), size)) from None
            except BaseException:  # Ctrl-C, for one: half an answer is no beginning for the next
                self._end()
                raise
        if "problems" in document:
            raise RecordingError(path, *document["problems"])
        return document, columns

    def _end(self, at_once: bool = True) -> int:
        process, self._process = self._process, None
        return 0 if process is None else process.end(at_once)


def _why(status: int, file_bytes: int) -> str:
    """Say what an ended process says of its file."""
    if status in (-getattr(signal, "SIGXCPU", 0), -getattr(signal, "SIGKILL", 0)):
        return (
            f"expected a recording that is read in {processor_s(file_bytes):.0f} s, got one that is not: it is "
            "damaged, or made to keep a program busy. Take a copy that is whole."
        )
    return (
        f"expected a whole recording that is read in {memory_bytes(file_bytes) >> 20} MiB, got one that ends its "
        f"reader (status {status}): it is damaged. Take a copy that is whole."
    )


READER: Final = Reader()  # the one of this program

atexit.register(READER.end)
