"""One command line taken apart: the command, its own arguments, and the options that every command has.

The latter may stand before the command or after it: ``hil --quiet run ...`` is ``hil run ... --quiet``.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from hil.errors import UsageError

QUIET = "--quiet"
LOG_LEVEL = "--log-level"
HELP, SHORT_HELP = "--help", "-h"

SPEAKERS = frozenset(
    {"bugreport", "commission", "completion", "effects", "look", "model", "monitor", "rig", "runs", "sim"}
)
"""Commands that ask, or whose output is what they are called for: ``--quiet`` does not silence them."""


@dataclass(frozen=True, slots=True)
class Call:
    """What is to be done.

    Attributes
    ----------
    command : str
        One of the commands, or ``--help``, ``--version``, or empty where nothing was asked for.
    arguments : tuple of str
        The command's own.
    quiet : bool
        Only errors, and what ``--json`` prints.
    log_level : str or None
        As given; None where it was not.
    """

    command: str
    arguments: tuple[str, ...] = ()
    quiet: bool = False
    log_level: str | None = None

    @classmethod
    def parse(cls, line: Sequence[str], commands: Collection[str]) -> Call:
        """Take a command line apart."""
        own, quiet, level = _common(line)
        if not own:
            return cls("", (), quiet, level)
        first = HELP if own[0] == SHORT_HELP else own[0]
        if first not in commands and first not in (HELP, "--version"):
            raise UsageError(_unknown(first, commands))
        return cls(first, tuple(own[1:]), quiet, level)

    @property
    def silent(self) -> bool:
        """Whether nothing is to be printed but errors."""
        return self.quiet and "--json" not in self.arguments and self.command not in SPEAKERS


def _common(line: Sequence[str]) -> tuple[list[str], bool, str | None]:
    """Return a line without the options of every command, and what these said; after ``--`` nothing is an option."""
    own: list[str] = []
    quiet, level = False, None
    words = iter(line)
    for word in words:
        if word == "--":
            return [*own, word, *words], quiet, level
        if word == QUIET:
            quiet = True
        elif word == LOG_LEVEL or word.startswith(f"{LOG_LEVEL}="):
            level = word.partition("=")[2] or next(words, None)
            if level is None:
                raise UsageError(f"Option '{LOG_LEVEL}' requires an argument. See: hil --help")
        else:
            own.append(word)
    return own, quiet, level


def _unknown(word: str, commands: Collection[str]) -> str:
    if word.startswith("-"):
        return f"No such option: {word}. See: hil --help"
    close = difflib.get_close_matches(word, commands, n=1)
    guess = f" Did you mean '{close[0]}'?" if close else ""
    return f"No such command '{word}'.{guess} See: hil --help"
