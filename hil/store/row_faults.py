"""What of a run's row can be used: a store may be damaged inside a row, or someone else's.

SQLite keeps no checksum: a bit that flipped in a text, or a value of another type, is still a whole database. What
can't be used is replaced by a neutral value, so that one row never takes the others' use away.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from hil.inside import is_inside
from hil.parse_json import parse_json

Row = dict[str, Any]

NEUTRAL: Final[Mapping[str, Any]] = MappingProxyType(
    {
        "added_utc": "",
        "recording": "(unknown)",
        "data_sha256": "",
        "experiment": "",
        "started_utc": "",
        "duration_s": 0.0,
        "samples": 0,
        "flagged": 0,
        "software_version": "",
        "outcome": "",
        "settings": "{}",
    }
)
"""What stands for a value of ``runs`` that can't be used."""


def faults_of(folder: Path, row: Mapping[str, Any]) -> tuple[str, ...]:
    """Name the columns of a row of ``runs`` whose value can't be used; ``folder`` is the store's."""
    return tuple(name for name in NEUTRAL if not _CHECKS.get(name, _is_text)(folder, row.get(name)))


def mended(row: Mapping[str, Any], faults: tuple[str, ...]) -> Row:
    """Return a row with neutral values for those that can't be used."""
    return {**row, **{name: NEUTRAL[name] for name in faults}}


def _is_text(_: Path, value: object) -> bool:
    return isinstance(value, str)


def _is_recording(folder: Path, value: object) -> bool:
    """Whether it is the name of a file in the store's folder: what is named here is read, packed, deleted."""
    return isinstance(value, str) and is_inside(folder, folder / value)


def _is_duration(_: Path, value: object) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _is_count(_: Path, value: object) -> bool:
    return isinstance(value, int) and value >= 0


def _is_settings(_: Path, value: object) -> bool:
    try:
        settings = parse_json(value) if isinstance(value, str) else None
    except ValueError:
        return False
    return isinstance(settings, dict) and all(isinstance(text, str) for text in settings.values())


_CHECKS: Final[Mapping[str, Callable[[Path, object], bool]]] = MappingProxyType(
    {
        "recording": _is_recording,
        "duration_s": _is_duration,
        "samples": _is_count,
        "flagged": _is_count,
        "settings": _is_settings,
    }
)
