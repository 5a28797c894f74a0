"""One remark on an EDS: how bad, which line, what was expected, what came, what to do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """How bad a remark is."""

    ERROR = "error"
    """This program needs it, or CiA 306 forbids it and it changes what the file says."""

    WARNING = "warning"
    """Not as CiA 306 has it, but vendors do it and this program copes, or does not use the object."""

    NOTE = "note"
    """Nothing is wrong for this program; another tool may think otherwise."""


@dataclass(frozen=True, slots=True)
class EdsFinding:
    """One remark.

    Attributes
    ----------
    severity
        How bad it is.
    line
        Line of the file, from 1; None if it concerns the file as a whole.
    place
        Section, and key if it concerns one: ``[60A9] DefaultValue``.
    expected, found
        Both in words.
    advice
        What to do, as a sentence.
    """

    severity: Severity
    line: int | None
    place: str
    expected: str
    found: str
    advice: str

    def __str__(self) -> str:
        return f"{self.place}: expected {self.expected}, found {self.found}. {self.advice}"
