"""What every rule is given: the file's text and objects, which objects this program uses, and how to say a thing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivers.capability.plan import DrivePlan
from drivers.datasheet.objects import EdsEntry, EdsObject
from drivers.datasheet.text import EdsFinding, EdsSection, EdsText, Severity

SAMPLE_NODE_ID = 127
"""Node id put in for ``$NODEID`` where the file is for none: the greatest, for it needs the most room."""


@dataclass(frozen=True, slots=True)
class EdsContext:
    """One file under check."""

    text: EdsText  # its sections and keys, line by line
    objects: Mapping[int, EdsObject]  # its object dictionary, by index
    plan: DrivePlan  # how a drive with it is used
    used: frozenset[int]  # objects this program reads or writes

    @property
    def node_id(self) -> int:
        """What ``$NODEID`` stands for."""
        return self.plan.sheet.node_id

    def severity(self, index: int) -> Severity:
        """How bad it is when an object is wrong."""
        return Severity.ERROR if index in self.used else Severity.WARNING

    def entry(self, index: int, subindex: int = 0) -> EdsEntry | None:
        """Look up one value of the object dictionary."""
        found = self.objects.get(index)
        return None if found is None else found.entries.get(subindex)


def at_key(severity: Severity, section: EdsSection, key: str, expected: str, found: str, advice: str) -> EdsFinding:
    """Say something about a key of a section; ``found`` is put before the value as written, if there is one."""
    written = section.keys.get(key.lower())
    got = f"{found} {written.value!r}".lstrip() if written is not None and written.value else found
    return EdsFinding(severity, section.line_of(key), f"[{section.name}] {key}", expected, got or "nothing", advice)


def at_section(severity: Severity, section: EdsSection, expected: str, found: str, advice: str) -> EdsFinding:
    """Say something about a section as a whole."""
    return EdsFinding(severity, section.line, f"[{section.name}]", expected, found, advice)


def at_file(severity: Severity, place: str, expected: str, found: str, advice: str) -> EdsFinding:
    """Say something that has no line: what it is about is not there."""
    return EdsFinding(severity, None, place, expected, found, advice)
