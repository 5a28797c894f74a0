"""MDF files, opened with every fault put into words."""

from __future__ import annotations

import io
import logging
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.errors import RecordingError
from hil.recording.bounds import damaged

if TYPE_CHECKING:
    from asammdf import MDF

DAMAGED = (
    OSError,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    OverflowError,
    MemoryError,
    AssertionError,
    RuntimeError,
    struct.error,
    zlib.error,
)
"""What asammdf raises, besides its own, on a file that is cut or damaged."""

FINISHED, UNFINISHED = b"MDF     ", b"UnFinMF "
"""Identification of a file whose writer came to its end, and of one whose did not (ASAM MDF 4.1, 5.5)."""

IDENTIFICATION_BYTES = 64


def require_mdf(path: Path, content: bytes) -> None:
    """Refuse what does not begin like an MDF file."""
    start = content[: len(FINISHED)]
    if len(content) < IDENTIFICATION_BYTES or start not in (FINISHED, UNFINISHED):
        raise RecordingError(
            path,
            f"expected a whole MDF file, one that begins with {FINISHED.decode()!r}, got one that begins "
            f"with {start!r}",
        )


def is_unfinished(path: Path) -> bool:
    """Whether a file was left by a writer that did not come to its end."""
    with path.open("rb") as file:
        return file.read(len(UNFINISHED)) == UNFINISHED


@contextmanager
def opened(path: Path) -> Iterator[MDF]:
    """Open a file for reading; one that is not finalised is finalised in a copy.

    The copy is in memory, always: asammdf maps a file, and a mapped file that is cut while it is read ends the process.
    """
    from asammdf import MDF
    from asammdf.blocks.utils import MdfException

    try:
        with _quiet(), MDF(io.BytesIO(path.read_bytes())) as mdf:
            yield mdf
    except (*DAMAGED, MdfException) as error:
        what = "one that can be finalised: its writer never finished it" if is_unfinished(path) else "a whole MDF file"
        raise damaged(path, what, error) from error


def channels_of(mdf: MDF, group: int) -> list[Any]:
    """Return the channels of one group, master and all."""
    groups: list[Any] = list(mdf.groups)
    return list(groups[group].channels)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep asammdf from printing tracebacks of what it raises as well."""
    logger = logging.getLogger("asammdf")
    before = logger.disabled
    logger.disabled = True
    try:
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        logger.disabled = before
