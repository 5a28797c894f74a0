"""The folder a command leaves its results in: held by one command at a time, and written whole.

All files are written next to their place first and moved in when each is complete.
"""

from __future__ import annotations

import errno
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Final

from hil.errors import UsageError

LOCK: Final = ".hil.lock"
"""Name of the file in a folder that says who holds it; a folder with nothing else in it is empty."""

_BEHIND_THE_TEXT: Final = 1 << 20


def require_folder(folder: Path) -> None:
    """Refuse a folder that can't be written to, before anything is computed."""
    existing = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not existing.is_dir():
        raise UsageError(f"{folder}: expected a folder to write into, got {existing}, which is a file")
    try:
        with tempfile.TemporaryFile(dir=existing):
            pass  # permissions alone don't tell: the disk may be full, or mounted read-only
    except OSError as error:
        raise _unwritable(folder, error) from error


@contextmanager
def sole_use(folder: Path) -> Iterator[None]:
    """Make a folder, and hold it for the time of a block; what nothing was put into is removed again.

    The operating system lets go of it when the process ends, however it ends: a lock is never left behind. A file of
    one that was killed holds nobody off.

    Raises
    ------
    UsageError
        If another process holds it, or it can't be written to.
    """
    require_folder(folder)
    missing = [each for each in (folder, *folder.absolute().parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = _locked(folder)
    except OSError as error:
        raise _unwritable(folder, error) from error
    try:
        with file:
            try:
                yield
            finally:
                with suppress(OSError):  # Windows keeps an open file, which holds nobody off either
                    (folder / LOCK).unlink()  # while it is still held
    finally:
        for each in missing:
            with suppress(OSError):  # it has something in it
                each.rmdir()


def _locked(folder: Path) -> IO[str]:
    """Return the lock's file, locked and signed; one that its last holder removed meanwhile is no lock any more."""
    path = folder / LOCK
    while True:
        file = path.open("a+", encoding="utf-8", buffering=1)
        try:
            if not _taken(file):
                file.seek(0)
                raise UsageError(
                    f"{folder}: expected no other call at work in this folder, got process {file.read().strip() or '?'}"
                    ". Wait for its end or end it by Ctrl-C, or choose another folder."
                )
            if path.exists() and os.path.samestat(path.stat(), os.fstat(file.fileno())):
                file.truncate(0)
                print(os.getpid(), file=file, flush=True)
                return file
        except BaseException:
            file.close()
            raise
        file.close()


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


def publish(folder: Path, files: Mapping[str, Callable[[Path], object]]) -> None:
    """Make files and move them into a folder; what was there under the same name is replaced."""
    for path in (folder / name for name in files):
        if path.is_dir():
            raise UsageError(f"{path}: expected the name of a file to write, got a folder. Name a file in it.")
    require_folder(folder)
    try:
        _publish(folder, files)
    except OSError as error:
        raise _unwritable(folder, error) from error


def _publish(folder: Path, files: Mapping[str, Callable[[Path], object]]) -> None:
    is_new = not folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".unfinished-") as workshop:
            for name, write in files.items():
                write(Path(workshop) / name)
            for name in files:
                (Path(workshop) / name).replace(folder / name)
    except BaseException:
        if is_new and not any(folder.iterdir()):
            folder.rmdir()
        raise


def _unwritable(folder: Path, error: OSError) -> UsageError:
    return UsageError(
        f"{folder}: expected a folder to write into, got: {error.strerror or error}. Make room there, or choose "
        "another with --out."
    )
