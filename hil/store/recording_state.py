"""Whether the recording of a run is still what it was."""

from __future__ import annotations

from hil.errors import RecordingError
from hil.recording.checksum import CHECKSUM
from hil.recording.recordings import read_facts
from hil.store.entry import RunEntry

VERIFIED = "whole, checksum verified"
UNPROVEN = "readable, it carries no checksum"


def recording_state(entry: RunEntry) -> str:
    """Read the recording of a run and say how it is."""
    if not entry.recording.exists():
        return "missing: it was moved or removed; 'hil runs rebuild' finds it again inside the store's folder"
    try:
        facts = read_facts(entry.recording)
    except RecordingError as error:
        return "; ".join(error.problems)
    checksum = facts.metadata.get(CHECKSUM, "")
    if checksum != entry.data_sha256:
        return "another recording under the same name: its checksum is not that of this run"
    return VERIFIED if checksum else UNPROVEN
