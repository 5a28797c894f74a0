"""What is in a recording, and what its channels could be: ``hil look``."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import tomlkit

from drivers.foreign_file import read_regular
from hil.printable import printable
from hil.recording import columns
from hil.recording.csv_format import FALLBACK, likely_encoding
from hil.recording.formats import format_of, tables_of
from hil.recording.request import FormatHints, Request
from hil.recording.sandbox import READER
from hil.recording.scales import Quantity, Role, unit_of
from hil.recording.survey import Group, Guess, Roles, Survey, guesses, roles_of, rounded, survey_of

LONG_PERIOD_S = 1.0
"""A period that no recording of a drive has: a time without a unit whose rows are as far is one in ms, perhaps."""

EPOCH_S = 1e9  # seconds since 1970 that no recording lasts: what is larger is a time of day

CHANNEL_HEADINGS = ("channel", "unit", "samples", "missing", "low", "high", "could be")


def signals_lines(survey: Survey, roles: Roles, encoding: str | None = None) -> list[str]:
    """Return the lines of a ``[signals]`` table; none where the file has the contract's columns."""
    lines = [] if is_own(survey) else list(_lines(survey, roles))
    if encoding is not None:
        lines.append(f'format = {{ encoding = "{encoding}" }}')
    return ["[signals]", *lines] if lines else []


def is_own(survey: Survey) -> bool:
    """Tell whether a file has the contract's columns, in its units, and one rate."""
    needed = {columns.TIME, columns.TORQUE_M1, columns.TORQUE_M2, columns.SPEED}
    return any(needed <= {channel.name for channel in group.channels} and group.even for group in survey.groups)


def _lines(survey: Survey, roles: Roles) -> Iterator[str]:
    if not survey.shows_a_course:
        yield "# one row shows no period and nothing that moves: look at a longer recording"
        return
    used = _groups_used(survey, roles)
    yield _time_line(used[0] if used else survey.groups[0])
    if roles.torques:
        yield f"torque = [ {', '.join(_entry(guess) for guess in roles.torques)} ]{_units_comment(roles.torques)}"
    else:
        yield "# torque = [ { column = ... } ]   # no channel is called or measured like one: name it"
    if roles.output is not None:
        at = ', at = "motor"' if roles.output.role is Role.SPEED else ""
        yield f"{roles.output.role.value} = {_entry(roles.output, at)}{_units_comment((roles.output,))}"
    else:
        yield "# speed = { column = ... }   # no channel is called or measured like one: name it"
    for guess in roles.others:
        yield f"# or {guess.role.value}: {_quoted(guess.channel.name)}"
    if len(used) > 1 or any(not group.even and group.period_s for group in used):
        slowest = max(group.period_s or 0.0 for group in used)
        why = "channels have times of their own" if len(used) > 1 else "rows are uneven"
        yield f"resample_s = {rounded(slowest)!r}   # {why}"


def _groups_used(survey: Survey, roles: Roles) -> list[Group]:
    chosen = {guess.channel for guess in (*roles.torques, *([roles.output] if roles.output else []))}
    return [group for group in survey.groups if chosen & set(group.channels)]


def _time_line(group: Group) -> str:
    if group.time is None:
        return "# time = { sample_time_s = ... }   # no channel is a time: write the true period"
    channel = next(channel for channel in group.channels if channel.name == group.time)
    unit = unit_of(channel.unit) if channel.unit else None
    is_timed = unit is not None and unit.quantity is Quantity.TIME
    scale = "" if is_timed else _epoch_scale(channel.high)
    unsure = not (is_timed or scale) and (group.period_s or 0.0) >= LONG_PERIOD_S
    comment = f"   # no unit: rows every {group.period_s:g} s, or give scale = 0.001 for ms" if unsure else ""
    return f"time = {{ column = {_quoted(channel.name)}{scale} }}{comment}"


def _epoch_scale(high: float | None) -> str:
    """Return the scale of a time since 1970 in ms, us or ns, by its size."""
    if high is None or high < 1e3 * EPOCH_S:
        return ""
    power = 3 * math.floor((math.log10(high) - math.log10(EPOCH_S)) / 3)
    return f", scale = 1e-{power}"


def _entry(guess: Guess, more: str = "") -> str:
    wraps = f", wraps_at = {guess.channel.wraps_at:g}" if guess.channel.wraps_at is not None else ""
    return f"{{ column = {_quoted(guess.channel.name)}{wraps}{more} }}"


def _units_comment(found: tuple[Guess, ...]) -> str:
    """Say what will be done with the unit, or that there is none."""
    texts = []
    for text in dict.fromkeys(guess.channel.unit for guess in found):
        unit = unit_of(text) if text else None
        text = printable(text)
        if unit is None:
            texts.append(f"in {text}, unknown: give scale" if text else "no unit: SI, or give scale")
        elif unit.quantity is Quantity.SHARE:
            texts.append(f"in {text}: give scale = rated value * {unit.factor:g}")
        elif unit.quantity is Quantity.OTHER:
            texts.append(f"in {text}: give scale to SI")
        elif unit.factor != 1.0:
            texts.append(f"in {text}, read times {unit.factor:.6g}")
    if any(guess.channel.wraps_at is not None for guess in found):
        texts.append("was stored with a sign and read without")
    return f"   # {'; '.join(texts)}" if texts else ""


def _quoted(name: str) -> str:
    return tomlkit.item(name).as_string()


@dataclass(frozen=True, slots=True)
class Look:
    """What is in a recording, what its channels could be, and the table that reads it."""

    path: Path  # as it was given
    survey: Survey  # every channel in figures
    roles: Roles  # what was chosen of the channels
    signals: tuple[str, ...]  # lines of a [signals] table; empty where none is needed


def channel_rows(group: Group) -> Iterator[tuple[str, str, int, int, float | None, float | None, str]]:
    """Give what is known of each channel of a time, in the order of ``CHANNEL_HEADINGS``."""
    for channel in group.channels:
        could = "time" if channel.name == group.time else ", ".join(g.role.value for g in guesses(channel))
        yield channel.name, channel.unit, channel.rows, channel.missing, channel.low, channel.high, could


def look(path: Path, dbc: Path | None = None) -> Look:
    """Look into a recording of any format; ``dbc`` describes the frames where it is a log of a bus."""
    known = format_of(path)
    encoding = None
    if known.is_sandboxed:
        survey = READER.survey(path, Request(dbc=dbc))
    else:
        encoding = likely_encoding(read_regular(path))
        survey = survey_of(tables_of(known, path, Request(FormatHints(encoding=encoding))))
    roles = roles_of(survey.groups)
    by_hand = encoding if encoding == FALLBACK else None
    return Look(path, survey, roles, tuple(signals_lines(survey, roles, by_hand)))
