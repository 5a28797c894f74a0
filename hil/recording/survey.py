"""Which channels could be torque and speed or position: by their unit, else by their name."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter

from hil.recording.channels import are_row_numbers, is_even_time, time_quantity
from hil.recording.resample import GAP, is_uniform, straightened
from hil.recording.scales import EXPECTED, Quantity, Role, called, unit_of, without_unit, wrapped_at
from hil.recording.table import LARGEST, Column, ColumnKind, Table
from hil.recording.text_form import MISSING

TIME_NAMES: Final = ("time", "zeit", "t", "timestamp", "timestamps", "stamp")
"""What a column of times is called, or begins with."""

BY_UNIT, BY_WORD, BY_LETTER, BY_CHANCE = 4, 3, 2, 1  # how sure a role is

WORDS: Final = {
    Role.TORQUE: r"torque|drehmoment|trq|\btq|moment|tau|force|kraft",
    Role.SPEED: r"speed|drehzahl|velocity|geschw|omega|rpm|\bvel",
    Role.POSITION: r"position|\bpos|angle|winkel|displacement|\bweg|phi",
}
"""Parts of names, as people write them in English and German."""

LETTERS: Final = {
    Role.TORQUE: r"T|[Tt]_?[Mm]?\d+|[Tt]_?[Mm]|[UuMmF]\d*|um|tq\d*",
    Role.SPEED: r"[nN](_?[mM])?\d*|[wW]\d*|v\d*",
    Role.POSITION: r"q(m)?\d*|p\d*|x\d*",
}
"""Whole names."""

ANY_OUTPUT: Final = r"[yz]\d*"  # names of a measured output of whatever kind

NOT_MEASURED: Final = re.compile(r"ref|soll|set|cmd|command|target|limit|max|min|prbs|demand|request", re.IGNORECASE)
"""Parts of names of what was asked for, not read."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel in figures; ranges are in the file's own unit."""

    name: str  # as in the file
    unit: str  # as the file writes it; empty where it gives none
    kind: str  # "number" or "text"
    rows: int  # missing ones included
    missing: int  # empty texts, or numbers that are not finite or beyond `LARGEST`
    low: float | None  # None for texts, and where every number is missing
    high: float | None  # None where `low` is
    increases: bool  # every row above the one before, and none missing
    wraps_at: float | None  # where it begins anew, if it was stored with a sign and is read without

    @property
    def moves(self) -> bool:
        """Whether it has numbers that differ."""
        return self.low is not None and self.low != self.high


@dataclass(frozen=True, slots=True)
class Group:
    """Channels that share their time; ``even`` where every row is a period after the one before."""

    time: str | None  # name of the channel of times; None where none was recognised
    period_s: float | None  # median step, in the file's unit where that is none of time; None without a time
    even: bool
    gaps: int  # steps longer than `GAP` periods
    channels: tuple[Channel, ...]  # that of the times included

    @property
    def rows(self) -> int:
        """Rows of the longest channel."""
        return max((channel.rows for channel in self.channels), default=0)


@dataclass(frozen=True, slots=True)
class Survey:
    """What is in a recording."""

    groups: tuple[Group, ...]  # one for each time
    said: tuple[str, ...] = ()  # remarks of the readers
    metadata: Mapping[str, str] = field(default_factory=dict)  # of all times together

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
        return TypeAdapter(Survey).validate_python(document)


def survey_of(tables: Sequence[Table]) -> Survey:
    """Return what is in the tables of one file, one for each time."""
    said = tuple(remark for table in tables for remark in table.remarks)
    metadata: dict[str, str] = {}
    for table in tables:
        metadata.update(table.metadata)
    return Survey(tuple(_group(table) for table in tables), said, metadata)


def _group(table: Table) -> Group:
    channels = tuple(channel_of(name, column, table.units.get(name, "")) for name, column in table.columns.items())
    time = _time(table, channels)
    if time is None:
        return Group(None, None, False, 0, channels)
    unit = unit_of(time.unit)
    factor = unit.factor if unit is not None and unit.quantity is Quantity.TIME else 1.0
    stamps = table.columns[time.name].astype(np.float64) * factor
    steps = np.diff(stamps)
    straight = straightened(stamps)
    period = float(np.median(steps if straight is None else np.diff(straight)))
    even = straight is not None or is_uniform(stamps)
    return Group(time.name, period, even, int((steps > GAP * period).sum()) if straight is None else 0, channels)


def channel_of(name: str, column: Column, unit: str) -> Channel:
    """Return a column in figures."""
    if ColumnKind.of(column) is ColumnKind.TEXT:
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
    name = channel.name.lower().rpartition(".")[2].rpartition("/")[2].strip("_ ")
    is_named = name in TIME_NAMES or name.startswith(("time", "zeit"))
    is_rising = is_even_time(column) and unit_of(channel.unit) is None
    return 4 * (is_named and not are_row_numbers(column)) + 2 * time_quantity(channel.unit) + is_rising


def rounded(period_s: float) -> float:
    """Return the roundest number within 2 % of a period."""
    for digits in range(1, 9):
        value = float(f"{period_s:.{digits}g}")
        if math.isclose(value, period_s, rel_tol=0.02):
            return value
    return period_s


@dataclass(frozen=True, slots=True)
class Guess:
    """What a channel could be, and how sure that is."""

    channel: Channel  # that could have the role
    role: Role  # one of several that it could have
    sure: int  # `BY_CHANCE` to `BY_UNIT`, one more where name and unit agree


@dataclass(frozen=True, slots=True)
class Roles:
    """What was chosen of a file, inputs to be summed and speed or position, and what else could be one of them."""

    torques: tuple[Guess, ...]  # inputs to be summed, called alike but for a number
    output: Guess | None  # speed or position; None where nothing could be one
    others: tuple[Guess, ...]  # guesses that were not chosen


def guesses(channel: Channel) -> list[Guess]:
    """Return what a channel could be; nothing where it stands still or was asked for."""
    if channel.kind != "number" or not channel.moves:
        return []
    bare = called(without_unit(channel.name))
    last = re.sub(r"\(.*\)$", "", bare) or bare
    if NOT_MEASURED.search(last):
        return []
    unit = unit_of(channel.unit) if channel.unit else None
    found = []
    for role in (Role.TORQUE, Role.SPEED, Role.POSITION):
        named = bool(re.search(WORDS[role], bare.lower()))
        is_far = unit is not None and unit.quantity is Quantity.LENGTH and not named  # of heights and distances, too
        if unit is not None and unit.quantity in EXPECTED[role] and not is_far:
            found.append(Guess(channel, role, BY_UNIT + named))
        elif unit is None or unit.quantity in (Quantity.OTHER, Quantity.SHARE):
            letter = re.fullmatch(LETTERS[role], last) is not None
            share = unit is not None and not named
            sure = 0 if share else BY_WORD if named else BY_LETTER if letter else 0
            found += [Guess(channel, role, sure)] if sure else []
    if not found and re.fullmatch(ANY_OUTPUT, last) and unit is None:
        found.append(Guess(channel, Role.SPEED, BY_CHANCE))
    return found


def looks_like_torque(name: str, column: Column, unit: str) -> bool:
    """Tell whether a column moves and has the name or the unit of a torque that was read."""
    return any(guess.role is Role.TORQUE for guess in guesses(channel_of(name, column, unit)))


def roles_of(groups: Sequence[Group]) -> Roles:
    """Choose inputs and output of all channels of a file."""
    times = {group.time for group in groups}
    channels = [channel for group in groups for channel in group.channels if channel.name not in times]
    all_guesses = [guess for channel in channels for guess in guesses(channel)]
    torques = _alike(guess for guess in all_guesses if guess.role is Role.TORQUE)
    taken = {guess.channel.name for guess in torques}
    outputs = [guess for guess in all_guesses if guess.role is not Role.TORQUE and guess.channel.name not in taken]
    output = max(outputs, key=_output_rank, default=None)
    others = [guess for guess in all_guesses if guess not in torques and guess is not output]
    return Roles(tuple(torques), output, tuple(others))


def _output_rank(guess: Guess) -> tuple[bool, int]:
    return guess.role is Role.SPEED and guess.sure >= BY_LETTER, guess.sure


def _alike(found: Iterable[Guess]) -> list[Guess]:
    """Return the surest, and those that are called like it but for a number: two inverters, not two sensors."""
    torques = list(found)
    if not torques:
        return []
    best = max(torques, key=lambda guess: guess.sure)
    shape = re.sub(r"\d+", "0", best.channel.name)
    return [g for g in torques if g.sure == best.sure and re.sub(r"\d+", "0", g.channel.name) == shape]
