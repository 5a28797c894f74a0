"""Caches of compiled kernels on disk: one folder for each version of the sources, and what becomes of the old ones.

A folder is in use as long as a process lives that took it: each holds a shared lock (``flock``) on a file in it, which
ends with the process however that ends. Taking it also sets that file's time, the time of last use. With a new folder,
and at no other time, the folders of other versions are removed whose files were neither written nor read for
`UNUSED_S` and that nobody holds. Where the system has no such locks, nothing is removed.
"""

from __future__ import annotations

import os
import shutil
import time
from contextlib import suppress
from pathlib import Path

UNUSED_S = 30 * 86_400.0  # a version that was not started for a month compiles anew: a minute or two

IN_USE = ".in_use"

_held: list[int] = []
"""Open files whose locks this process holds until it ends."""


def take(folder: Path) -> None:
    """Take a cache for this process, and make it if it is new; then remove what no version has used for long.

    Where nothing can be written, nothing is done here: numba says what it can't do.
    """
    is_new = not folder.exists()
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        _held.append(os.open(folder / IN_USE, os.O_WRONLY | os.O_CREAT))
        os.utime(folder / IN_USE)
        if _lock(_held[-1], exclusive=False) and is_new:
            _remove_unused(folder)


def _remove_unused(folder: Path) -> None:
    """Remove the caches of the same kind in the same place that have not been used for long."""
    kind = folder.name.partition("-")[0]
    for other in folder.parent.glob(f"{kind}-*"):
        if other != folder and time.time() - _last_use(other) > UNUSED_S:
            _remove_if_free(other)


def _last_use(folder: Path) -> float:
    """Return when a file of a folder was last written, or read, as far as the file system keeps that [s since 1970]."""
    times = [folder.stat().st_mtime]
    for path in folder.rglob("*"):
        with suppress(FileNotFoundError):
            status = path.stat()
            times += [status.st_mtime, status.st_atime if path.is_file() else 0.0]
    return max(times)


def _remove_if_free(folder: Path) -> None:
    """Remove a cache that no process holds: for that time, none can take it."""
    file = os.open(folder / IN_USE, os.O_WRONLY | os.O_CREAT)
    try:
        if _lock(file, exclusive=True):
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(file)


def _lock(file: int, exclusive: bool) -> bool:
    """Lock an open file until it is closed, and tell whether that could be."""
    try:
        import fcntl
    except ImportError:
        return False
    try:
        fcntl.flock(file, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
