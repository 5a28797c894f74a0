"""What a drive lacks and somebody has accepted, by name, in the rig file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

PLACEHOLDERS: Final = ("NAME", "REASON")
"""Of name and reason, in a line to be filled in."""


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Who accepted it, and why.

    Attributes
    ----------
    by
        A person's name.
    why
        What stops the torque instead, or why it does not have to.
    """

    by: str
    why: str

    @property
    def is_by_a_person(self) -> bool:
        """Whether somebody filled in name and reason: a line that was only pasted is nobody's acceptance."""
        return _is_filled_in(self.by) and _is_filled_in(self.why)

    def __str__(self) -> str:
        return f"accepted by {self.by}: {self.why}"


def acceptance_line(name: str) -> str:
    """Write the line of the rig file that accepts what is missing, to be filled in."""
    by, why = PLACEHOLDERS
    return f'accepted.{name} = {{ by = "{by}", why = "{why}" }}'


def _is_filled_in(text: str) -> bool:
    """Whether a person has written something: not blank or dots, and not what stands in the line to be filled in."""
    words = text.strip(" .<>\"'").upper()
    return any(map(str.isalnum, words)) and words not in PLACEHOLDERS
