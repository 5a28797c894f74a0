"""What a recording says of itself: experiment, the whole rig file, and which EDS the scales are from."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from pathlib import Path

from drivers.resources import data_file
from hil import __version__
from hil.config.rig_file import read_rig


def run_metadata(rig_path: Path, experiment: str) -> dict[str, str]:
    """Describe a run that begins now.

    Parameters
    ----------
    rig_path
        The rig file.
    experiment
        Name of the experiment.

    Raises
    ------
    RigFileError
        If the rig file can't be read.
    """
    inverters = read_rig(rig_path).inverters
    shipped = data_file("inverter.eds")
    return {
        "schema": "hil.recording/1",
        "hil_version": __version__,
        "experiment": experiment,
        "started_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "rig_file": rig_path.read_text(encoding="utf-8"),
        "eds_m1_sha256": _sha256(inverters.m1.eds or shipped),
        "eds_m2_sha256": _sha256(inverters.m2.eds or shipped),
    }


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
