"""Processes that this program starts: they end with it, and import nothing from the folder they happen to be in.

Each is the first of a session and a group of its own: what it starts itself, as an FMU's code may, is ended with it. Of
this program's files it inherits only its pipes. A pipe stays open as long as any of a group holds it, so who waits at
one looks at the process as well.

Python looks for modules in the working folder first, for ``-m`` and ``-c`` alike: a ``pickle.py`` next to somebody's
recordings would be run. ``-P`` (PYTHONSAFEPATH) leaves that out. A process that needs no folder gets an empty one.
"""

from __future__ import annotations

import io
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer

VARIABLE: Final = "PYTHONSAFEPATH"

PACKAGES: Final = Path(__file__).resolve().parents[1]
"""Where the packages of this program are."""

LOOK_S: Final = 0.1
"""How often who waits at a pipe looks whether the process is still there [s]."""


def python(*arguments: str) -> list[str]:
    """Return the command line of a Python process with these arguments."""
    return [sys.executable, "-P", *arguments]


def environment(**more: str) -> dict[str, str]:
    """Return the environment of such a process: it finds this very program, installed or not."""
    found = [str(PACKAGES), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(found), **more}


@contextmanager
def safe_path() -> Iterator[None]:
    """Give the same to processes that ``multiprocessing`` starts in the block: it has no option for it."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def start(command: Sequence[str], **options: Any) -> subprocess.Popen[Any]:
    """Start a process in a session of its own; ``options`` as `subprocess.Popen` has them. End it by `end`."""
    return subprocess.Popen(command, start_new_session=True, close_fds=True, **options)


def end(process: subprocess.Popen[Any], patience_s: float = 0.0) -> int:
    """End a process and all of its group, and return the status it ended with; it may end by itself before.

    The group is ended while its first process is still to be waited for: until then nobody else gets its number.
    """
    until_s = time.monotonic() + patience_s
    while not has_ended(process) and time.monotonic() < until_s:
        time.sleep(min(LOOK_S, patience_s) / 10.0)
    if process.returncode is None or not hasattr(os, "waitid"):
        _kill_group(process)
    status = process.wait()
    for stream in (process.stdin, process.stdout, process.stderr):
        with suppress(OSError):  # what was still to be written to a process that is gone
            if stream is not None:
                stream.close()
    return status


def has_ended(process: subprocess.Popen[Any]) -> bool:
    """Whether a process has ended; it stays to be waited for where the system can leave it so."""
    if process.returncode is not None or not hasattr(os, "waitid"):
        return process.poll() is not None
    try:
        return os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
    except ChildProcessError:  # somebody else has waited for it
        return process.poll() is not None


def _kill_group(process: subprocess.Popen[Any]) -> None:
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):  # macOS: a group of which all have ended
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


@dataclass(frozen=True, slots=True)
class Done:
    """How a command ended: its status, None where it took too long, and what it said."""

    status: int | None  # below 0: minus the number of the signal that ended it
    said: str  # on its standard error


def run(command: Sequence[str], folder: Path, limit_s: float, env: dict[str, str] | None = None) -> Done:
    """Run a command to its end, or the end of its time, with all it starts; ``said`` is its standard error."""
    with tempfile.TemporaryFile() as complaints:  # no pipe: others of its group may hold that open
        process = start(
            command, cwd=folder, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=complaints
        )
        try:
            until_s = time.monotonic() + limit_s
            while not (ended := has_ended(process)) and time.monotonic() < until_s:
                time.sleep(LOOK_S / 10.0)
        finally:
            status = end(process)
        complaints.seek(0)
        return Done(status if ended else None, complaints.read().decode(errors="replace"))


class Pipe(io.RawIOBase):
    """One end of a pipe to a process, which is at its end as soon as the process or its time is, whoever else has it.

    ``limit_at_s`` [s, `time.monotonic`] may be set before each request.
    """

    def __init__(self, stream: IO[bytes], process: subprocess.Popen[Any]) -> None:
        self._stream, self._process = stream, process
        self._writes = stream.writable()
        self.limit_at_s = float("inf")
        if os.name == "posix":
            os.set_blocking(stream.fileno(), not self._writes)

    def readable(self) -> bool:
        """Whether it is the end that is read."""
        return not self._writes

    def writable(self) -> bool:
        """Whether it is the end that is written."""
        return self._writes

    def readinto(self, place: WriteableBuffer) -> int:
        """Read what is there; 0 at the end."""
        if not self._is_ready():
            return 0
        content = os.read(self._stream.fileno(), len(memoryview(place)))
        memoryview(place)[: len(content)] = content
        return len(content)

    def write(self, content: ReadableBuffer) -> int:
        """Write what there is room for; a `BrokenPipeError` at the end."""
        while True:
            if not self._is_ready():
                raise BrokenPipeError
            with suppress(BlockingIOError):
                return os.write(self._stream.fileno(), content)

    def close(self) -> None:
        """Close it; what the process is no longer there to take is dropped."""
        if not self.closed:
            super().close()
            with suppress(OSError):
                self._stream.close()

    def _is_ready(self) -> bool:
        """Wait until something can be read or written; False at the end of the process, or of its time."""
        if os.name != "posix":  # which can't wait at a pipe, and where nobody inherits one
            return True
        poller = select.poll()
        poller.register(self._stream.fileno(), select.POLLOUT if self._writes else select.POLLIN)
        while time.monotonic() < self.limit_at_s:
            ended = has_ended(self._process)
            if poller.poll(0 if ended else LOOK_S * 1000.0):  # what it wrote before it ended is read
                return True
            if ended:
                break
        return False
