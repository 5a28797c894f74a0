"""Whether recordings are of the rig that the next experiment is designed for."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path

from estimator.signals.record import Location, OutputKind, Record
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.recording.checksum import RIG_TEXT
from hil.recording.recordings import read_facts

SAME_PERIOD = 1e-3
"""Relative difference of sampling periods that rounding of time stamps makes."""


def require_of_rig(paths: Sequence[Path], records: Sequence[Record], rig: Rig) -> None:
    """Refuse recordings of another rig, at another period, or of another quantity than the motor's speed."""
    for path, record in zip(paths, records, strict=False):
        if not math.isclose(record.sample_time_s, rig.period_s, rel_tol=SAME_PERIOD):
            raise UsageError(
                f"{path}: a period of {record.sample_time_s:g} s, expected {rig.period_s:g} s, that of rig "
                f"{rig.name!r}. Name the rig that it was recorded with."
            )
        if (record.kind, record.location) != (OutputKind.SPEED, Location.MOTOR):
            raise UsageError(
                f"{path}: {record.kind.value} at the {record.location.value}, expected the motor's speed, which is "
                "what a rig records. Diagnose it by hil diagnose."
            )
        name = _rig_of(path)
        if name not in (None, rig.name):
            raise UsageError(f"{path}: recorded with rig {name!r}, expected {rig.name!r}. Name its own rig file.")


def _rig_of(path: Path) -> str | None:
    """Return the name of the rig that a recording says it is of; None where it says nothing."""
    text = read_facts(path).metadata.get(RIG_TEXT, "")
    try:
        name = tomllib.loads(text).get("name")
    except tomllib.TOMLDecodeError:
        return None
    return name if isinstance(name, str) else None
