"""One way to say that a disk does not take what was to be kept."""

from __future__ import annotations

from pathlib import Path

from hil.errors import RecordingError

CURE = "Make room, or choose another disk."


def no_room(path: Path, what: str, error: OSError, then: str = CURE) -> RecordingError:
    """Return what is raised for a file that could not be written; ``then`` says what is kept and what to do."""
    return RecordingError(path, f"expected room for {what}, got: {error.strerror or error}. {then}".rstrip())
