"""Which channels could be torque and speed or position: by their unit, else by their name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from hil.recording.look.survey import Channel, Group
from hil.recording.scales import EXPECTED, Role
from hil.recording.units import Quantity, unit_of, without_unit

BY_UNIT, BY_WORD, BY_LETTER, BY_CHANCE = 4, 3, 2, 1
"""How sure a role is."""

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

ANY_OUTPUT: Final = r"[yz]\d*"
"""Names of a measured output of whatever kind."""

NOT_MEASURED: Final = re.compile(r"ref|soll|set|cmd|command|target|limit|max|min|prbs|demand|request", re.IGNORECASE)
"""Parts of names of what was asked for, not read."""


@dataclass(frozen=True, slots=True)
class Guess:
    """What a channel could be, and how sure that is."""

    channel: Channel
    role: Role
    sure: int


@dataclass(frozen=True, slots=True)
class Roles:
    """What was chosen of a file, and what else it could be.

    Attributes
    ----------
    torques : tuple of Guess
        Inputs, to be summed; empty where none is likely.
    output : Guess or None
        Speed or position.
    others : tuple of Guess
        What else could be one of them.
    """

    torques: tuple[Guess, ...]
    output: Guess | None
    others: tuple[Guess, ...]


def guesses(channel: Channel) -> list[Guess]:
    """Return what a channel could be; nothing where it stands still or was asked for."""
    if channel.kind != "number" or not channel.moves:
        return []
    bare = without_unit(channel.name)
    last = re.sub(r"\(.*\)$", "", re.split(r"[./]", bare)[-1].strip()) or bare
    if NOT_MEASURED.search(last):
        return []
    unit = unit_of(channel.unit) if channel.unit else None
    found = []
    for role in (Role.TORQUE, Role.SPEED, Role.POSITION):
        named = bool(re.search(WORDS[role], bare.lower()))
        if unit is not None and unit.quantity in EXPECTED[role] and not _is_far(unit.quantity, named):
            found.append(Guess(channel, role, BY_UNIT + named))
        elif unit is None or unit.quantity in (Quantity.OTHER, Quantity.SHARE):
            letter = re.fullmatch(LETTERS[role], last) is not None
            share = unit is not None and not named
            sure = 0 if share else BY_WORD if named else BY_LETTER if letter else 0
            found += [Guess(channel, role, sure)] if sure else []
    if not found and re.fullmatch(ANY_OUTPUT, last) and unit is None:
        found.append(Guess(channel, Role.SPEED, BY_CHANCE))
    return found


def _is_far(quantity: Quantity, named: bool) -> bool:
    """Tell whether a unit alone says nothing: metres are of heights and distances, too."""
    return quantity is Quantity.LENGTH and not named


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
