"""The one way to open a file that somebody else may have put there: a regular one, and no more than it has.

A name among recordings may be a pipe that nobody writes to, a device, or a link to one: who reads that waits for ever,
or fills the memory. `hil` opens its files through this module as well; `tests/bad_input/test_one_rule.py` sees to it.
"""

from __future__ import annotations

import errno
import io
import os
import stat
from pathlib import Path
from typing import Final

_KINDS: Final = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}

_FLAGS: Final = os.O_RDONLY | sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_NOCTTY", "O_CLOEXEC", "O_BINARY"))
"""Not even the opening waits: what the name means may change between the look and the opening."""


def require_regular(path: Path | str) -> os.stat_result:
    """Return what the system says of a regular file, links followed; an `OSError` that names what it is instead."""
    about = os.stat(path)
    _require_regular(about, path)
    return about


def open_regular(path: Path | str) -> io.BufferedReader:
    """Open a regular file for reading bytes; see `require_regular`."""
    require_regular(path)  # first: the opening alone of some devices has an effect
    file = os.fdopen(os.open(path, _FLAGS), "rb")
    try:
        _require_regular(os.fstat(file.fileno()), path)
    except OSError:
        file.close()
        raise
    return file


def read_regular(path: Path | str, most_bytes: int | None = None) -> bytes:
    """Return the bytes of a regular file; an `OSError` where there are more than that."""
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size  # a file that others make longer meanwhile does not end either
        if most_bytes is not None and size > most_bytes:
            raise OSError(errno.EFBIG, f"more than {most_bytes >> 20} MB", str(path))
        return file.read(size)


def open_regular_text(path: Path | str, errors: str = "strict") -> io.TextIOWrapper:
    """Open a regular file of text in UTF-8; ``errors`` as Python has it."""
    return io.TextIOWrapper(open_regular(path), encoding="utf-8", errors=errors)


def read_regular_text(path: Path | str, errors: str = "strict") -> str:
    """Return the text of a regular file in UTF-8, every end of a line as a line feed."""
    with open_regular_text(path, errors) as file:
        return file.read()


def _require_regular(about: os.stat_result, path: Path | str) -> None:
    if stat.S_ISDIR(about.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(about.st_mode):
        kind = _KINDS.get(stat.S_IFMT(about.st_mode), "no file")
        raise OSError(errno.EINVAL, f"{kind}, not a regular file", str(path))
