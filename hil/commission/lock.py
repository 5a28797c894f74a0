"""One call at a time on the folder of a commissioning: two would drive the same drives and overwrite one state."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Final

from hil.errors import UsageError

LOCK: Final = ".commission.lock"
_BEHIND_THE_TEXT: Final = 1 << 20


@contextmanager
def sole_use(folder: Path) -> Iterator[None]:
    """Hold a folder for the time of a block.

    The operating system lets go of it when the process ends, however it ends: a lock is never left behind. The file
    stays, for a lock on a file that is removed and made anew holds nobody off.
    """
    with _opened(folder / LOCK) as file:
        if not _taken(file):
            file.seek(0)
            holder = file.read().strip() or "?"
            raise UsageError(
                f"{folder}: expected no other call at work on this commissioning, got process {holder}. "
                "Wait for its end or end it by Ctrl-C, or choose another folder by --out."
            )
        _sign(file)
        yield


def _opened(path: Path) -> IO[str]:
    try:
        return path.open("a+", encoding="utf-8", buffering=1)
    except OSError as error:
        raise _unwritable(path, error) from error


def _sign(file: IO[str]) -> None:
    """Write who holds it."""
    try:
        file.truncate(0)
        print(os.getpid(), file=file, flush=True)
    except OSError as error:
        raise _unwritable(Path(file.name), error) from error


def _unwritable(path: Path, error: OSError) -> UsageError:
    return UsageError(
        f"{path}: expected a place to write to, got: {error.strerror or error}. Make room there, or choose another "
        "folder by --out."
    )


def _taken(file: IO[str]) -> bool:
    """Take the lock where nobody has it; never waits."""
    try:
        if sys.platform == "win32":
            import msvcrt

            file.seek(_BEHIND_THE_TEXT)  # what is locked there can't be read by others
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN, errno.EDEADLK):
            return False
        raise
    return True
