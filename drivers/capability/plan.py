"""What a drive has, by its data sheet: its abilities, and the PDOs that carry command and feedback. No bus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from drivers.capability.carrier import RPDO, TPDO, Carrier, Direction, ObjectId, object_name
from drivers.capability.carrier_search import CarrierSearch, find_carriers, find_further, interfering_pdos
from drivers.capability.table import EVENT_TIMER, TABLE, Capability, Function, Part, Without
from drivers.datasheet.file import DataSheet
from drivers.datasheet.objects import EdsEntry
from drivers.errors import ConfigMismatch
from drivers.scaling import IntegerType

COMMAND = (Function.CONTROLWORD, Function.TORQUE_TARGET, Function.TORQUE_OFFSET)
FEEDBACK = (Function.STATUSWORD, Function.TORQUE_ACTUAL, Function.SPEED_ACTUAL)
"""What the PDOs of each direction carry, in the order in which this program maps it."""


@dataclass(frozen=True, slots=True)
class Shortcoming:
    """Why one object does not take part."""

    part: Part  # the object, as the table wants it
    entry: EdsEntry | None  # the object, as the data sheet has it
    key: str  # key of the data sheet that says so
    expected: str  # what a run needs, in words
    found: str  # what the data sheet says, in words

    def __str__(self) -> str:
        name = f"0x{self.part.index:04X}:{self.part.subindex:02X}"
        return f"{name} has {self.found}" if self.entry is not None else f"no {name}"


@dataclass(frozen=True, slots=True)
class Ability:
    """What a drive has of one function."""

    capability: Capability  # its row of the table
    parts: tuple[Part, ...]  # the objects that give it
    shortcomings: tuple[Shortcoming, ...] = ()  # why the ways before, or all of them, are none

    @property
    def given(self) -> bool:
        """Whether the drive has it at all."""
        return bool(self.parts)

    def writable(self, sheet: DataSheet) -> bool:
        """Whether its objects can be written and read back."""
        entries = [sheet.entry(part.index, part.subindex) for part in self.parts]
        return self.given and all(entry is not None and entry.settable for entry in entries)


Abilities = Mapping[Function, Ability]


def abilities(sheet: DataSheet) -> dict[Function, Ability]:
    """Find what a drive has of each function, but for what its PDOs decide (`DrivePlan`)."""
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


@dataclass(frozen=True, slots=True)
class DrivePlan:
    """How one drive is used."""

    sheet: DataSheet  # its data sheet
    abilities: Abilities  # what it has of each function
    command: CarrierSearch  # for RPDOs that carry what is commanded
    feedback: CarrierSearch  # for TPDOs that carry what is read
    channels: tuple[ObjectId, ...]  # further objects that are to be recorded
    further: CarrierSearch  # the search for the TPDOs that carry those which the feedback's do not carry

    def has(self, function: Function) -> bool:
        """Tell whether the drive has a function."""
        return self.abilities[function].given

    @property
    def missing(self) -> tuple[Ability, ...]:
        """Functions without which the drive can't be used, and which it does not have."""
        rows = self.abilities.values()
        return tuple(each for each in rows if not each.given and each.capability.without is Without.REFUSED)

    @property
    def carriers(self) -> tuple[Carrier, ...]:
        """All PDOs in use: of commands, of feedback, of further channels."""
        return (*self.command.carriers, *self.feedback.carriers, *self.further.carriers)

    @property
    def pdos_to_disable(self) -> tuple[int, ...]:
        """Communication parameters of PDOs that are to be switched off."""
        return tuple(interfering_pdos(self.sheet, self.carriers))

    @property
    def used(self) -> frozenset[int]:
        """Objects that are read or written, and those without which the drive can't be used."""
        asked = [each for function, each in self.abilities.items() if function is not Function.TORQUE_SLOPE]
        parts = {part.index for each in asked for part in each.parts}
        parts |= {lacking.part.index for each in self.missing for lacking in each.shortcomings}
        layouts = [carrier.layout for carrier in self.carriers]
        return frozenset(
            parts | {index for each in layouts for index in (each.communication_index, each.mapping_index)}
        )

    def pdos(self, direction: Direction) -> tuple[Carrier, ...]:
        """Return the PDOs of a direction; ConfigMismatch, with what is lacking, for a drive that can't be used."""
        if self.missing:
            lacking = "; ".join(_lacking(each) for each in self.missing)
            raise ConfigMismatch(
                f"{self.sheet.kind} {self.sheet.path}: expected {lacking}. The drive can't be used. See: "
                f"hil check --eds {self.sheet.path}"
            )
        search = self.command if direction is RPDO else self.feedback
        if not search.carriers:
            functions = COMMAND if direction is RPDO else FEEDBACK
            wanted = wanted_names(self, functions)
            raise ConfigMismatch(
                f"{self.sheet.kind} {self.sheet.path}: expected one {direction.name} or several that map {wanted}"
                f", or that can be mapped, found {'; '.join(search.others) or f'no {direction.name}'}. "
                f"See: hil check --eds {self.sheet.path}"
            )
        return search.carriers

    def channel_carriers(self) -> tuple[Carrier, ...]:
        """Give the TPDOs that carry the further objects to be recorded; those of the feedback may be among them."""
        carriers = (*self.feedback.carriers, *self.further.carriers)
        lacking = [each for each in self.channels if not any(carrier.carries(*each) for carrier in carriers)]
        if lacking:
            raise ConfigMismatch(
                f"{self.sheet.kind} {self.sheet.path}: expected a TPDO that maps "
                f"{', '.join(object_name(*each) for each in lacking)}, or that can be mapped and is not used, found "
                f"{'; '.join(self.further.others) or 'no TPDO'}. Record another object."
            )
        return tuple(each for each in carriers if any(each.carries(*channel) for channel in self.channels))


def plan_drive(sheet: DataSheet, channels: Sequence[ObjectId] = ()) -> DrivePlan:
    """Find how a drive can be used, further objects recorded; what it lacks is in the plan."""
    found = abilities(sheet)
    command = find_carriers(sheet, RPDO, *_choices(found))
    if not all(command.carries(part.index) for part in found[Function.TORQUE_OFFSET].parts):
        found[Function.TORQUE_OFFSET] = replace(found[Function.TORQUE_OFFSET], parts=())
    feedback = find_carriers(sheet, TPDO, _objects(found, FEEDBACK))
    found[Function.RPDO_DEADLINE] = _deadline(sheet, found[Function.RPDO_DEADLINE], command)
    further = find_further(sheet, channels, feedback.carriers)
    return DrivePlan(sheet, found, command, feedback, tuple(channels), further)


def wanted_names(plan: DrivePlan, functions: tuple[Function, ...]) -> str:
    """Name what a PDO has to carry: ``0x6041, 0x6077, 0x606C``."""
    return ", ".join(object_name(*each) for each in _objects(plan.abilities, functions))


def _choices(found: Abilities) -> Iterator[list[ObjectId]]:
    """List what RPDOs may carry: with the torque offset, where there is one, or with the sum, which needs less room."""
    if found[Function.TORQUE_OFFSET].given:
        yield _objects(found, COMMAND)
    yield _objects(found, tuple(each for each in COMMAND if each is not Function.TORQUE_OFFSET))


def _objects(found: Abilities, functions: tuple[Function, ...]) -> list[ObjectId]:
    return [(part.index, part.subindex) for part in _each_part(found, functions)]


def _each_part(found: Abilities, functions: tuple[Function, ...]) -> Iterator[Part]:
    for function in functions:
        ability = found[function]
        if ability.given:
            yield ability.parts[0]
        elif ability.capability.without is Without.REFUSED:
            yield ability.capability.ways[0][0]


def _deadline(sheet: DataSheet, ability: Ability, command: CarrierSearch) -> Ability:
    target = TABLE[Function.TORQUE_TARGET].ways[0][0].index
    index = next((each.layout.communication_index for each in command.carriers if each.carries(target)), None)
    if index is None:
        return ability
    entry = sheet.entry(index, EVENT_TIMER)
    there = (
        entry is not None and entry.settable and entry.kind is not None and entry.kind.code == IntegerType.UNSIGNED16
    )
    return replace(
        ability,
        parts=(Part(index, EVENT_TIMER, (IntegerType.UNSIGNED16,), written=True, read_back=True),) if there else (),
    )


def _lacking(ability: Ability) -> str:
    reasons = ", ".join(map(str, ability.shortcomings))
    return f"{ability.capability.function.value} ({reasons})"
