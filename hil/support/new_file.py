"""Writes a file that was not there before, whole or not at all."""

from __future__ import annotations

from pathlib import Path

from hil.errors import UsageError


def refuse_existing(path: Path) -> None:
    """Refuse a file that is there, before anything is asked.

    Raises
    ------
    UsageError
        If it is.
    """
    if path.exists():
        raise UsageError(f"{path}: expected a new file, got one that is there. Give another name, or move it away.")


def write_new(path: Path, content: str | bytes) -> None:
    """Write a new file; text in UTF-8.

    Raises
    ------
    UsageError
        If there is one by now, or the folder does not take it; nothing is left half written.
    """
    try:
        with path.open("xb") as file:
            try:
                file.write(content.encode() if isinstance(content, str) else content)
                file.flush()
            except OSError:
                path.unlink()
                raise
    except FileExistsError as cause:
        raise UsageError(f"{path}: expected a new file, got one that is there") from cause
    except OSError as cause:
        raise UsageError(f"{path}: expected a place to write to, got: {cause.strerror}. Give another.") from cause
