"""One PDO that carries what is wanted: as the data sheet maps it, or mapped by this program. No bus.

An identifier that the data sheet gives by the node id is kept, and so is that of a DCF for this node. Any other is a
constant, which two drives with the same file would both have: the PDO then gets its node's one of the pre-defined
connection set, or of those above the fourth, which have none there, a free one of the first four.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.canopen.pdo_map import (
    COB_ID_EXTENDED,
    COB_ID_NO_RTR,
    MAX_MAPPED,
    MAX_PDO_BYTES,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    MappedObject,
    PdoLayout,
    read_layout,
)
from drivers.datasheet.file import DataSheet
from drivers.datasheet.objects import EdsEntry
from drivers.datasheet.types import DATA_TYPES
from drivers.scaling import IntegerType

PDO_NUMBERS: Final = range(0x200)  # offsets of the up to 512 PDOs from 0x1400, 0x1600, 0x1800 and 0x1A00

PREDEFINED: Final = 4
"""PDOs of each direction that have an identifier in the pre-defined connection set (CiA 301, 7.3.5)."""

FILLERS: Final = range(1, 8)
"""Indices by which an RPDO maps nothing, in the width of that data type (CiA 301, 7.4.7.1)."""

MULTIPLEX: Final = (0xFE, 0xFF)
"""Numbers of mapped objects that stand for a multiplexed PDO (CiA 301, 7.5.2.36)."""

RESERVED_COB_IDS: Final = (
    range(0x000, 0x080),
    range(0x080, 0x081),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)
"""Identifiers that no PDO may have (CiA 301, table 38: restricted), and SYNC's."""


ObjectId = tuple[int, int]  # index and subindex of an object

EVERY_SYNC: Final = 1
EVENT_DRIVEN: Final = (254, 255)  # transmission types (CiA 301, 7.5.2.35)


def object_name(index: int, subindex: int) -> str:
    """Name an object: ``0x6077``, or ``0x1018:01``."""
    return f"0x{index:04X}:{subindex:02X}" if subindex else f"0x{index:04X}"


def is_reserved(cob_id: int) -> bool:
    """Whether an identifier is none for a PDO."""
    return any(cob_id in taken for taken in RESERVED_COB_IDS)


@dataclass(frozen=True, slots=True)
class Direction:
    """One of the two directions of PDOs."""

    name: str  # RPDO or TPDO
    communication: int  # index of the first one's communication parameter: 0x1400, 0x1800
    mapping: int  # index of its mapping parameter: 0x1600, 0x1A00
    access: tuple[str, ...]  # access types of what one may carry
    first_cob_id: int  # of the first PDO, node 0, in CiA 301's pre-defined connection set
    types: range  # transmission types that this program can use

    def predefined(self, number: int) -> int:
        """Give the identifier that the pre-defined connection set has for node 0 and one of the first four PDOs."""
        return self.first_cob_id + 0x100 * number


RPDO: Final = Direction("RPDO", RPDO_COMMUNICATION, RPDO_MAPPING, ("wo", "rw", "rww"), 0x200, range(241))
TPDO: Final = Direction("TPDO", TPDO_COMMUNICATION, TPDO_MAPPING, ("ro", "rw", "rwr", "const"), 0x180, range(1, 2))
"""A command may take effect at any SYNC; feedback has to come at every one."""


@dataclass(frozen=True, slots=True)
class Carrier:
    """One PDO in use."""

    layout: PdoLayout  # what it has in a run
    described: PdoLayout | None  # what the data sheet says it has before
    mapped_here: bool  # whether this program maps it, for the data sheet's own mapping is another
    fixed: frozenset[tuple[int, int]]  # entries ``(index, subindex)`` of its parameters that can't be written

    def carries(self, index: int, subindex: int = 0) -> bool:
        """Tell whether an object is mapped in this PDO."""
        return any((mapped.index, mapped.subindex) == (index, subindex) for mapped in self.layout.objects)

    @property
    def mapping_is_fixed(self) -> bool:
        """Whether the mapping can't be written."""
        return any(index == self.layout.mapping_index for index, _ in self.fixed)

    def written(self, index: int, subindex: int) -> bool:
        """Whether an entry of its parameters is written when it is configured."""
        if index == self.layout.mapping_index:
            return not self.mapping_is_fixed
        return (index, subindex) not in self.fixed


class Unusable(Exception):
    """A PDO that is none; the text says why."""


def cob_id_of(sheet: DataSheet, direction: Direction, number: int, taken: Collection[int] = ()) -> int | None:
    """Give the identifier a PDO has in a run; None if there is none for it but those ``taken``."""
    entry = sheet.entry(direction.communication + number, 1)
    value = None if entry is None else entry.value(sheet.node_id)
    own = entry is not None and (entry.node_relative or sheet.commissioned_node == sheet.node_id)
    if own and value is not None and not value & COB_ID_EXTENDED and not is_reserved(value & 0x7FF):
        return value & 0x7FF
    numbers = (number,) if number < PREDEFINED else range(PREDEFINED)
    free = [direction.predefined(n) + sheet.node_id for n in numbers]
    return next((cob_id for cob_id in free if cob_id not in taken), None)


def _described(sheet: DataSheet, direction: Direction, number: int) -> PdoLayout:

    def read(index: int, subindex: int) -> int:
        value = sheet.value(index, subindex)
        if value is None:
            raise Unusable(f"0x{index:04X}:{subindex:02X} without a value that can be read")
        if (index, subindex) == (mapping, 0) and value > MAX_MAPPED:
            reason = "a multiplexed PDO" if value in MULTIPLEX else f"not allowed, at most {MAX_MAPPED} (CiA 301)"
            raise Unusable(f"0x{index:04X}:00 is {value}: {reason}")
        return value

    mapping = direction.mapping + number
    return read_layout(read, direction.communication + number, mapping)


def as_described(
    sheet: DataSheet,
    direction: Direction,
    number: int,
    wanted: Collection[ObjectId],
    taken: Collection[int] = (),
    also: Collection[int] = (),
) -> Carrier:
    """Take a PDO as the data sheet maps it: with one or more of the objects wanted."""
    described = _described(sheet, direction, number)
    carried = {(mapped.index, mapped.subindex) for mapped in described.objects}
    more = {mapped.index for mapped in described.objects} - {*(index for index, _ in wanted), *also, *FILLERS}
    if not carried & {*wanted} or (direction is RPDO and more):
        raise Unusable(str(described))
    for mapped in described.objects:
        _require_known(sheet, direction, mapped)
    if sum(mapped.length_bits for mapped in described.objects) > 8 * MAX_PDO_BYTES:
        raise Unusable(f"{described}: more than {MAX_PDO_BYTES} bytes")
    return _carrier(sheet, direction, number, described.objects, described, taken, mapped_here=False)


def _require_known(sheet: DataSheet, direction: Direction, mapped: MappedObject) -> None:
    entry = sheet.entry(mapped.index, mapped.subindex)
    kind = DATA_TYPES.get(mapped.index) if mapped.index in FILLERS else None if entry is None else entry.kind
    if kind is None or not kind.is_integer or kind.bits != mapped.length_bits or mapped.length_bits not in (8, 16, 32):
        raise Unusable(f"maps {mapped}, expected an integer object of that length")
    if mapped.index in FILLERS and direction is TPDO:
        raise Unusable(f"maps {mapped}, a filler")


def map_here(
    sheet: DataSheet, direction: Direction, number: int, wanted: Sequence[ObjectId], taken: Collection[int] = ()
) -> Carrier:
    """Take a PDO and have it map all of the objects wanted; parameters and errors as `as_described`."""
    mapping = direction.mapping + number
    objects = tuple(_mappable(sheet, direction, *each) for each in wanted)
    if sum(mapped.length_bits for mapped in objects) > 8 * MAX_PDO_BYTES:
        raise Unusable(f"more than {MAX_PDO_BYTES} bytes for {', '.join(map(str, objects))}")
    for n in range(len(objects) + 1):
        entry = sheet.entry(mapping, n)
        if entry is None or not entry.settable:
            lacking = "is not there" if entry is None else f"can not be {'read' if entry.writable else 'written'}"
            raise Unusable(f"0x{mapping:04X}:{n:02X} {lacking}")
    try:
        described = _described(sheet, direction, number)
    except Unusable:
        described = None
    return _carrier(sheet, direction, number, objects, described, taken, mapped_here=True)


def _mappable(sheet: DataSheet, direction: Direction, index: int, subindex: int) -> MappedObject:
    entry, name = sheet.entry(index, subindex), object_name(index, subindex)
    if entry is None or entry.kind is None or entry.kind.bits is None:
        raise Unusable(f"{name} is not there, or of no known type")
    if not entry.mappable:
        raise Unusable(f"{name} has PDOMapping=0")
    if entry.access not in direction.access:
        raise Unusable(f"{name} has AccessType {entry.access}, which no {direction.name} carries")
    return MappedObject(index, subindex, entry.kind.bits)


def _carrier(
    sheet: DataSheet,
    direction: Direction,
    number: int,
    objects: tuple[MappedObject, ...],
    described: PdoLayout | None,
    taken: Collection[int],
    *,
    mapped_here: bool,
) -> Carrier:
    communication, mapping = direction.communication + number, direction.mapping + number
    places = [(communication, 1), (communication, 2), *((mapping, n) for n in range(len(objects) + 1))]
    entries = {place: sheet.entry(*place) for place in places}
    for place, entry in entries.items():
        _require_type(entry, place, communication)
    unread = [place for place, entry in entries.items() if entry is not None and not entry.readable]
    if unread:
        raise Unusable(f"0x{unread[0][0]:04X}:{unread[0][1]:02X} can not be read")
    fixed = frozenset(place for place, entry in entries.items() if entry is None or not entry.writable)
    cob_id = cob_id_of(sheet, direction, number, taken)
    if cob_id is None or cob_id in taken:
        raise Unusable(f"no identifier in 0x{communication:04X}:01, and no free one in the pre-defined connection set")
    if (communication, 1) in fixed and sheet.value(communication, 1) not in (cob_id, cob_id | COB_ID_NO_RTR):
        raise Unusable(f"0x{communication:04X}:01 can not be written and has not COB-ID 0x{cob_id:03X}, switched on")
    layout = PdoLayout(
        communication,
        mapping,
        cob_id,
        True,
        _transmission_type(sheet, direction, communication),
        objects,
        no_rtr=described is not None and described.no_rtr,
    )
    return Carrier(layout, described, mapped_here, fixed)


def _require_type(entry: EdsEntry | None, place: tuple[int, int], communication: int) -> None:
    """See that a parameter has CiA 301's type: UNSIGNED8 for type and count, UNSIGNED32 for the others."""
    index, subindex = place
    small = subindex == (2 if index == communication else 0)
    kind = IntegerType.UNSIGNED8 if small else IntegerType.UNSIGNED32
    if entry is None or entry.kind is None or entry.kind.code != kind:
        found = "is not there" if entry is None else "has another data type"
        raise Unusable(f"0x{index:04X}:{subindex:02X} {found}, expected {kind.name}")


def _transmission_type(sheet: DataSheet, direction: Direction, communication: int) -> int:
    """Choose the transmission type: the data sheet's where it does, else every SYNC where it can be written."""
    entry = sheet.entry(communication, 2)
    value = None if entry is None else entry.value(sheet.node_id)
    if value is not None and value in direction.types:
        return value
    if entry is not None and entry.writable:
        return EVERY_SYNC
    if direction is RPDO and value in EVENT_DRIVEN:
        return value  # on arrival: earlier than at SYNC, and all the same a command
    raise Unusable(f"0x{communication:04X}:02 is {value} and can not be written, expected {EVERY_SYNC}")
