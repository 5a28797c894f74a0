"""Take a recording away, with what stands next to it."""

from __future__ import annotations

from pathlib import Path

from hil.errors import RecordingError, UsageError
from hil.parse_json import read_json
from hil.recording.checksum import CHECKSUM
from hil.recording.description import is_sidecar
from hil.recording.formats import FORMATS, read_metadata
from hil.store.entry import RunEntry
from hil.store.register import is_run
from hil.store.results import ONLINE_SCHEMA, ONLINE_SUFFIX


def require_own(entry: RunEntry) -> None:
    """See that the file a run names is its recording: nothing else is deleted. One that is gone passes.

    Raises
    ------
    UsageError
        If it is something else, or can't be read.
    """
    path = entry.recording
    if not path.exists():
        return
    try:
        said = read_metadata(path)
    except RecordingError as error:
        raise UsageError(f"{error}\nNothing was deleted; delete the file yourself.") from error
    if not is_run(said) or said.get(CHECKSUM, "") != entry.data_sha256:
        raise UsageError(
            f"{path}: expected the recording of this run, got another file. Nothing was deleted; delete it yourself, "
            "or leave --with-recording out."
        )


def remove_files(entry: RunEntry) -> list[Path]:
    """Delete a recording and what was made with it: its sidecar and the course of its on-line estimate.

    Returns
    -------
    list of Path
        What was deleted.

    Raises
    ------
    UsageError
        If it is not the run's recording, or the system does not let it.
    """
    require_own(entry)
    recording = entry.recording
    known = FORMATS.get(recording.suffix.lower())
    companion = [] if known is None or known.companion is None else [known.companion(recording)]
    course = recording.with_name(f"{recording.stem}{ONLINE_SUFFIX}")
    removed = []
    for path in (*filter(is_sidecar, companion), *([course] if _is_course(course) else []), recording):
        try:
            path.unlink()
        except FileNotFoundError:
            continue
        except OSError as error:
            raise UsageError(
                f"{path}: expected a file that can be deleted, got: {error.strerror or error}. The run is out of the "
                "store; delete the file yourself."
            ) from error
        removed.append(path)
    return removed


def _is_course(path: Path) -> bool:
    try:
        document = read_json(path)
    except (OSError, ValueError):
        return False
    return isinstance(document, dict) and document.get("schema") == ONLINE_SCHEMA
