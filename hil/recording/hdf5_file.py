"""HDF5 files, read with every fault put into words, and written whole."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hil.recording.damaged import damaged

DAMAGED = (OSError, KeyError, ValueError, TypeError, RuntimeError, IndexError, AttributeError)
"""What h5py raises on a file that is cut or damaged."""


@contextmanager
def reading(path: Path, what: str) -> Iterator[Any]:
    """Open a file for reading.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What kind of file is expected, for people.

    Yields
    ------
    h5py.File

    Raises
    ------
    RecordingError
        For everything that goes wrong in the block because the file is no whole one.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            yield file
    except DAMAGED as error:
        raise damaged(path, f"a whole {what} file", error) from error


def write_whole(path: Path, fill: Callable[[Any], None], header: bytes = b"") -> None:
    """Write a file; it is made in memory, so that a full disk is told by Python, in words, and not by HDF5.

    Parameters
    ----------
    path : Path
        The file.
    fill : callable
        Puts the content into the h5py.File it is given.
    header : bytes
        What stands before HDF5's own content, in a user block of 512 bytes.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    import h5py

    content = io.BytesIO()
    with h5py.File(content, "w", userblock_size=512 if header else 0) as file:
        fill(file)
    content.seek(0)
    content.write(header)
    path.write_bytes(content.getbuffer())
