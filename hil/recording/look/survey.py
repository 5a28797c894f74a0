"""What is in a recording: its channels in figures, in groups that share their time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final

import numpy as np

from hil.recording.kinds import Column, Kind
from hil.recording.resample import GAP
from hil.recording.scales import wrapped_at
from hil.recording.table import LARGEST, Table
from hil.recording.text.cells import MISSING
from hil.recording.time_base import straightened
from hil.recording.units import Quantity, unit_of

TIME_NAMES: Final = ("time", "zeit", "t", "timestamp", "timestamps", "stamp")
"""What a column of times is called, or begins with."""

EVEN: Final = 0.5
"""Share of the period by which a step of an even time may differ from it."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel in figures.

    Attributes
    ----------
    name, unit : str
        As the file has them; the unit is empty where it has none.
    kind : str
        ``number`` or ``text``.
    rows, missing : int
        Samples, and how many of them hold no number.
    low, high : float or None
        Range, in the file's own unit; None where there is no number.
    increases : bool
        Whether every value is above the one before.
    wraps_at : float or None
        Where it begins anew, if it was stored with a sign and is read without.
    """

    name: str
    unit: str
    kind: str
    rows: int
    missing: int
    low: float | None
    high: float | None
    increases: bool
    wraps_at: float | None

    @property
    def moves(self) -> bool:
        """Whether it has numbers that differ."""
        return self.low is not None and self.low != self.high


@dataclass(frozen=True, slots=True)
class Group:
    """Channels that share their time.

    Attributes
    ----------
    time : str or None
        The channel that is their time.
    period_s : float or None
        Usual distance of two rows; None without a time.
    even : bool
        Whether rows can be read as they are, every one a period after the one before.
    gaps : int
        Places where rows are missing.
    channels : tuple of Channel
    """

    time: str | None
    period_s: float | None
    even: bool
    gaps: int
    channels: tuple[Channel, ...]

    @property
    def rows(self) -> int:
        """Rows of the longest channel."""
        return max((channel.rows for channel in self.channels), default=0)


@dataclass(frozen=True, slots=True)
class Survey:
    """What is in a recording."""

    groups: tuple[Group, ...]
    said: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)

    @property
    def shows_a_course(self) -> bool:
        """Whether any channel has two rows: of one alone nobody can tell what is a time, its period, or what moves."""
        return any(group.rows > 1 for group in self.groups)

    def as_document(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return asdict(self)

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Survey:
        """Return what `as_document` was made of."""
        groups = [
            Group(**{**group, "channels": tuple(Channel(**channel) for channel in group["channels"])})
            for group in document["groups"]
        ]
        return cls(tuple(groups), tuple(document["said"]), document["metadata"])


def survey_of(tables: Sequence[Table]) -> Survey:
    """Return what is in the tables of one file, one for each time."""
    said = tuple(remark for table in tables for remark in table.remarks)
    metadata: dict[str, str] = {}
    for table in tables:
        metadata.update(table.metadata)
    return Survey(tuple(_group(table) for table in tables), said, metadata)


def _group(table: Table) -> Group:
    channels = tuple(_channel(name, column, table.units.get(name, "")) for name, column in table.columns.items())
    time = _time(table, channels)
    if time is None:
        return Group(None, None, False, 0, channels)
    unit = unit_of(time.unit)
    factor = unit.factor if unit is not None and unit.quantity is Quantity.TIME else 1.0
    stamps = table.columns[time.name].astype(np.float64) * factor
    steps = np.diff(stamps)
    straight = straightened(stamps)
    period = float(np.median(steps if straight is None else np.diff(straight)))
    even = straight is not None or bool((steps > 0.0).all() and (np.abs(steps - period) <= EVEN * period).all())
    return Group(time.name, period, even, int((steps > GAP * period).sum()) if straight is None else 0, channels)


def _channel(name: str, column: Column, unit: str) -> Channel:
    if Kind.of(column) is Kind.TEXT:
        empty = sum(cell in MISSING for cell in column.tolist())
        return Channel(name, unit, "text", int(column.size), empty, None, None, False, None)
    numbers = column.astype(np.float64)
    seen = numbers[np.isfinite(numbers) & (np.abs(numbers) <= LARGEST)]
    low, high = (float(seen.min()), float(seen.max())) if seen.size else (None, None)
    increases = bool(seen.size == numbers.size and numbers.size > 1 and (np.diff(numbers) > 0.0).all())
    missing = int(numbers.size - seen.size)
    return Channel(name, unit, "number", int(numbers.size), missing, low, high, increases, wrapped_at(numbers))


def _time(table: Table, channels: Sequence[Channel]) -> Channel | None:
    """Return the channel that is the time: the file's own, else the likeliest."""
    by_name = {channel.name: channel for channel in channels}
    if table.master is not None and table.master in by_name:
        return by_name[table.master]
    likely = [(rank, channel) for channel in channels if (rank := _time_rank(table, channel)) > 0]
    return max(likely, key=lambda pair: pair[0])[1] if likely else None


def _time_rank(table: Table, channel: Channel) -> int:
    """Return how much a channel is like a time; 0 where it can't be one."""
    if channel.kind != "number" or channel.missing or channel.rows < 2 or not channel.moves:
        return 0
    column = table.columns[channel.name]
    if not bool((np.diff(column.astype(np.float64)) >= 0.0).all()):
        return 0
    name = channel.name.lower().rpartition(".")[2].rpartition("/")[2]
    unit = unit_of(channel.unit)
    is_named = name in TIME_NAMES or name.startswith(("time", "zeit"))
    is_unit = unit is not None and unit.quantity is Quantity.TIME
    return 2 * is_named + is_unit


def rounded(period_s: float) -> float:
    """Return the roundest number within 2 % of a period."""
    for digits in range(1, 9):
        value = float(f"{period_s:.{digits}g}")
        if math.isclose(value, period_s, rel_tol=0.02):
            return value
    return period_s
