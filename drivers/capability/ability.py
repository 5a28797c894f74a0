"""Which functions of the capability table a drive has, by its data sheet alone. No bus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from drivers.capability.function import Capability, Function, Part
from drivers.capability.table import TABLE
from drivers.datasheet.objects import EdsEntry
from drivers.datasheet.sheet import DataSheet


@dataclass(frozen=True, slots=True)
class Shortcoming:
    """Why one object does not take part.

    Attributes
    ----------
    part
        The object, as the table wants it.
    entry
        The object, as the data sheet has it; None if it has no such.
    key
        Key of the data sheet that says so; empty without the object.
    expected, found
        Both in words.
    """

    part: Part
    entry: EdsEntry | None
    key: str
    expected: str
    found: str

    def __str__(self) -> str:
        name = f"0x{self.part.index:04X}:{self.part.subindex:02X}"
        return f"{name} has {self.found}" if self.entry is not None else f"no {name}"


@dataclass(frozen=True, slots=True)
class Ability:
    """What a drive has of one function.

    Attributes
    ----------
    capability
        Its row of the table.
    parts
        The objects that give it; empty if the drive does not have it.
    shortcomings
        Why the ways before, or all of them, are none.
    """

    capability: Capability
    parts: tuple[Part, ...]
    shortcomings: tuple[Shortcoming, ...] = ()

    @property
    def given(self) -> bool:
        """Whether the drive has it."""
        return bool(self.parts)

    def writable(self, sheet: DataSheet) -> bool:
        """Whether its objects can be written and read back."""
        entries = [sheet.entry(part.index, part.subindex) for part in self.parts]
        return self.given and all(entry is not None and entry.settable for entry in entries)


Abilities = Mapping[Function, Ability]


def abilities(sheet: DataSheet) -> dict[Function, Ability]:
    """Find what a drive has of each function, but for what its PDOs decide (`drivers.capability.plan`)."""
    return {function: _ability(sheet, row) for function, row in TABLE.items()}


def _ability(sheet: DataSheet, row: Capability) -> Ability:
    shortcomings: list[Shortcoming] = []
    for way in row.ways:
        lacking = [each for part in way for each in _shortcomings(sheet, part)]
        if not lacking:
            return Ability(row, way, tuple(shortcomings))
        shortcomings += lacking
    return Ability(row, (), tuple(shortcomings))


def _shortcomings(sheet: DataSheet, part: Part) -> Iterator[Shortcoming]:
    entry = sheet.entry(part.index, part.subindex)
    if entry is None:
        yield Shortcoming(part, None, "", "the object", "no such object")
        return
    if entry.kind is None or entry.kind.code not in part.kinds:
        kinds = " or ".join(f"0x{kind:04X} ({kind.name})" for kind in part.kinds)
        found = "no data type that is known" if entry.kind is None else f"data type {entry.kind.name}"
        yield Shortcoming(part, entry, "DataType", kinds, found)
    yield from _access(sheet, part, entry)


def _access(sheet: DataSheet, part: Part, entry: EdsEntry) -> Iterator[Shortcoming]:
    if part.written and not (entry.settable if part.read_back else entry.writable):
        value = entry.value(sheet.node_id)
        if entry.access is None or part.held is None or value not in part.held:
            found = "no access type" if entry.access is None else f"access type {entry.access}"
            expected = f"one that can be written{' and read' if part.read_back else ''}"
            yield Shortcoming(part, entry, "AccessType", expected, found)
    elif not part.written and not entry.readable:
        found = "no access type" if entry.access is None else f"access type {entry.access}"
        yield Shortcoming(part, entry, "AccessType", "one that can be read", found)
