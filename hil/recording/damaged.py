"""One way to say that a recording's file is damaged."""

from __future__ import annotations

from pathlib import Path

from hil.errors import RecordingError


def damaged(path: Path, expected: str, error: Exception) -> RecordingError:
    """Return what is raised for a file of which a library says that it is not whole."""
    got = str(error) or type(error).__name__
    return RecordingError(
        path,
        f"expected {expected}, got a damaged or truncated one ({got.rstrip('.')}). Take a copy that is whole.",
    )
