"""What a recording says of itself: experiment, the whole rig file and its checksum, which EDS the scales are from."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from pathlib import Path

from drivers.foreign_file import read_regular, read_regular_text
from drivers.resources import data_file
from hil.config.rig_file import read_rig
from hil.recording.checksum import RIG_CHECKSUM, RIG_TEXT, text_sha256
from hil.version import __version__

EARLIEST_NS = 946_684_800 * 1_000_000_000
"""The year 2000: a time before it is none of a calendar, but counted from the beginning of a trace."""


def run_metadata(rig_path: Path, experiment: str, text: str | None = None) -> dict[str, str]:
    """Describe a run that begins now; ``text`` is that of the rig file with what was changed for this run."""
    inverters = read_rig(rig_path).inverters
    text = read_regular_text(rig_path) if text is None else text
    shipped = data_file("inverter.eds")
    return {
        "schema": "hil.recording/1",
        "hil_version": __version__,
        "experiment": experiment,
        "started_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        RIG_TEXT: text,
        RIG_CHECKSUM: text_sha256(text),
        "eds_m1_sha256": _sha256(inverters.m1.eds or shipped),
        "eds_m2_sha256": _sha256(inverters.m2.eds or shipped),
    }


def replay_metadata(rig_path: Path, trace: Path, first_ns: int) -> dict[str, str]:
    """Describe a recording that is rebuilt from a bus trace."""
    metadata = {**run_metadata(rig_path, f"replay of {trace.name}"), "replayed_from": trace.name}
    del metadata["started_utc"]  # it began long before now
    if first_ns >= EARLIEST_NS:
        started = datetime.fromtimestamp(first_ns / 1e9, UTC)
        metadata["started_utc"] = started.isoformat(timespec="seconds")
    return metadata


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_regular(path)).hexdigest()
