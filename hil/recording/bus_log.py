"""Frames of a CAN bus as a logger keeps them (ASAM MDF bus logging), and the signals that a DBC file makes of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from hil.errors import RecordingError

if TYPE_CHECKING:
    from asammdf import MDF

BUS_EVENT: Final = 2
"""Flag of a group of bus events, ``cg_flags`` (ASAM MDF 4.1, table 51)."""

LARGEST_DBC_BYTES: Final = 32 << 20
"""One of a whole vehicle has some megabytes."""

ANY_BUS: Final = 0
"""Channel of the bus, as asammdf counts: every one."""


def is_bus_log(mdf: MDF) -> bool:
    """Whether all a file holds are frames of a bus."""
    groups = [group.channel_group for group in mdf.groups if group.channel_group.cycles_nr]
    return bool(groups) and all(int(getattr(group, "flags", 0)) & BUS_EVENT for group in groups)


def decoded(path: Path, mdf: MDF, dbc: Path) -> MDF:
    """Return the signals of a logged bus, a J1939 one among them, as a file of their own in memory."""
    if not any(int(getattr(group.channel_group, "flags", 0)) & BUS_EVENT for group in mdf.groups):
        raise RecordingError(path, "expected the frames of a bus for --dbc, got signals. Leave --dbc out.")
    signals = mdf.extract_bus_logging({"CAN": [(_database(path, dbc), ANY_BUS)]})
    if not any(group.channel_group.cycles_nr for group in signals.groups):
        raise RecordingError(
            path,
            f"--dbc {dbc}: expected a description of the frames in this file, got none of them. Is it of another bus?",
        )
    return signals


def _database(path: Path, dbc: Path) -> Path:
    """Return a DBC file that can be read."""
    from asammdf.blocks.utils import load_can_database

    if dbc.suffix.lower() != ".dbc":
        raise RecordingError(path, f"--dbc {dbc}: expected a DBC file, named .dbc, got {dbc.suffix!r}")
    try:
        size = dbc.stat().st_size
        database = load_can_database(dbc) if size <= LARGEST_DBC_BYTES else None
    except Exception as error:
        raise RecordingError(path, f"--dbc {dbc}: expected a DBC file, got: {type(error).__name__}: {error}") from error
    if database is None or not database.frames:
        raise RecordingError(path, f"--dbc {dbc}: expected a DBC file that describes messages, got one without any")
    return dbc
