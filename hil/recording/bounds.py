"""How much a recording may be, and what reading it may take: bounds that follow from the size of its file.

A file says how many cells it holds before any is read, and formats that compress can say anything: a sparse HDF5 file
of 2 kB has 10¹² zeros. A recording has at most one cell for each byte of its file, small files a floor of `CELLS`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from hil.errors import RecordingError

CELLS: Final = 1 << 24
"""A file of any size may hold as many: two million rows of eight columns, 128 MiB as numbers."""

COLUMNS: Final = 10_000
"""The largest number of columns; a measurement file of a whole vehicle has some thousand."""

MEMORY_BYTES: Final = 448 << 20
MEMORY_PER_BYTE: Final = 24
"""What reading may take: a floor, and for large files a multiple of their size (a cell in a few copies)."""

PROCESSOR_S: Final = 10.0
BYTES_PER_S: Final = 2e5
"""Time it may take: a floor, and for large files a twentieth of the 4 MB/s measured with MDF."""

CURE = "Make room, or choose another disk."


def memory_bytes(file_bytes: int) -> int:
    """Return what reading a recording of that size may take [byte]."""
    return max(MEMORY_BYTES, MEMORY_PER_BYTE * file_bytes)


def processor_s(file_bytes: int) -> float:
    """Return the time of a processor that reading a recording of that size may take [s]."""
    return PROCESSOR_S + file_bytes / BYTES_PER_S


def require_cells(path: Path, cells: int) -> None:
    """Refuse what is more than a recording of its file's size can be, before any of it is read."""
    size = path.stat().st_size
    most = max(CELLS, size)
    if cells > most:
        raise RecordingError(
            path,
            f"expected at most {most} cells in a file of {size} bytes, got {cells}. It is damaged, or "
            "made to fill the memory; cut a recording that is so large into several.",
        )


def require_columns(path: Path, columns: int) -> None:
    """Refuse more columns than a recording has."""
    if columns > COLUMNS:
        raise RecordingError(path, f"expected at most {COLUMNS} columns, got {columns}. Leave out what is not needed.")


def damaged(path: Path, expected: str, error: Exception) -> RecordingError:
    """Return what is raised for a file of which a library says that it is not whole."""
    got = str(error) or type(error).__name__
    return RecordingError(
        path, f"expected {expected}, got a damaged or truncated one ({got.rstrip('.')}). Take a copy that is whole."
    )


def no_room(path: Path, what: str, error: OSError, then: str = CURE) -> RecordingError:
    """Return what is raised for a file that could not be written; ``then`` says what is kept and what to do."""
    return RecordingError(path, f"expected room for {what}, got: {error.strerror or error}. {then}".rstrip())
