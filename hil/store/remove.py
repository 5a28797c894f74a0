"""Take a recording away, with what stands beside it."""

from __future__ import annotations

from pathlib import Path

from hil.errors import UsageError
from hil.recording.formats import FORMATS
from hil.store.results import ONLINE_SUFFIX


def remove_files(recording: Path) -> list[Path]:
    """Delete a recording and what was made with it: its sidecar and the course of its on-line estimate.

    Returns
    -------
    list of Path
        What was deleted.

    Raises
    ------
    UsageError
        If the system does not let it.
    """
    known = FORMATS.get(recording.suffix.lower())
    beside = [] if known is None or known.beside is None else [known.beside(recording)]
    removed = []
    course = recording.with_name(f"{recording.stem}{ONLINE_SUFFIX}")
    for path in (*beside, course, recording):
        try:
            path.unlink()
        except FileNotFoundError:
            continue
        except OSError as error:
            raise UsageError(
                f"{path}: expected a file that can be deleted, came: {error.strerror or error}. The run is out of the "
                "store; delete the file yourself."
            ) from error
        removed.append(path)
    return removed
