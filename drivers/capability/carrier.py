"""Which PDO carries what: one that maps it, or else one that can be mapped by this program. No bus.

A maker's own PDOs seldom carry torque command and feedback in one frame each. So the search goes on to the first PDO
whose parameters can be written and whose mapping has room; the host maps it then at every configuration, in the order
of CiA 301, 7.5.2.36.

An identifier that the data sheet gives by the node id is kept, and so is that of a DCF for this node. Any other is a
constant, which two drives with the same file would both have: the PDO then gets its node's one of the pre-defined
connection set.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.canopen.pdo_map import (
    COB_ID_EXTENDED,
    COB_ID_INVALID,
    MAX_PDO_BYTES,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    MappedObject,
    PdoLayout,
    read_layout,
)
from drivers.datasheet.objects import EdsEntry
from drivers.datasheet.sheet import DataSheet
from drivers.datasheet.types import DATA_TYPES
from drivers.errors import ConfigMismatch
from drivers.scaling import IntegerType

PDO_NUMBERS: Final = range(0x200)
"""Offsets of the up to 512 PDOs from 0x1400, 0x1600, 0x1800 and 0x1A00."""

FILLERS: Final = range(1, 8)
"""Indices by which an RPDO maps nothing, in the width of that data type (CiA 301, 7.4.7.1)."""

MAX_OBJECTS: Final = 0x40
"""Most objects of a mapping; greater counts stand for a multiplexed PDO (CiA 301, 7.5.2.36)."""

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


@dataclass(frozen=True, slots=True)
class Direction:
    """One of the two directions of PDOs.

    Attributes
    ----------
    name
        RPDO or TPDO.
    communication, mapping
        Indices of the parameters of the first.
    access
        Access types of what one may carry.
    first_cob_id
        Identifier of the first for node 0; the three after it follow at distances of 0x100.
    types
        Transmission types that this program can use.
    """

    name: str
    communication: int
    mapping: int
    access: tuple[str, ...]
    first_cob_id: int
    types: range

    def predefined(self, number: int) -> int | None:
        """Give the identifier for node 0 in the pre-defined connection set; None beyond the fourth PDO."""
        return self.first_cob_id + 0x100 * number if number < 4 else None


RPDO: Final = Direction("RPDO", RPDO_COMMUNICATION, RPDO_MAPPING, ("wo", "rw", "rww"), 0x200, range(241))
TPDO: Final = Direction("TPDO", TPDO_COMMUNICATION, TPDO_MAPPING, ("ro", "rw", "rwr", "const"), 0x180, range(1, 2))
"""A command may take effect at any SYNC; feedback has to come at every one."""

EVERY_SYNC: Final = 1
EVENT_DRIVEN: Final = (254, 255)
"""Transmission types (CiA 301, 7.5.2.35)."""


@dataclass(frozen=True, slots=True)
class Carrier:
    """One PDO in use.

    Attributes
    ----------
    layout
        What it has in a run.
    described
        What the data sheet says it has before; None where it does not say.
    mapped_here
        Whether this program maps it, for the data sheet's own mapping is another.
    fixed
        Entries ``(index, subindex)`` of its parameters that can't be written.
    """

    layout: PdoLayout
    described: PdoLayout | None
    mapped_here: bool
    fixed: frozenset[tuple[int, int]]

    @property
    def mapping_is_fixed(self) -> bool:
        """Whether the mapping can't be written, or not as CiA 301 wants it."""
        return any(index == self.layout.mapping_index for index, _ in self.fixed)

    def written(self, index: int, subindex: int) -> bool:
        """Whether an entry of its parameters is written when it is configured."""
        if index == self.layout.mapping_index:
            return not self.mapping_is_fixed
        return (index, subindex) not in self.fixed


@dataclass(frozen=True, slots=True)
class CarrierSearch:
    """What a search came to: the PDO found, and those looked at before it, in words."""

    carrier: Carrier | None
    others: tuple[str, ...]


class _Unusable(Exception):
    """A PDO that is none; the text says why."""


def find_carrier(sheet: DataSheet, direction: Direction, wanted: Sequence[int]) -> CarrierSearch:
    """Find the PDO that carries the objects ``wanted``, by index.

    Parameters
    ----------
    sheet
        The drive.
    direction
        Which way the objects go.
    wanted
        What is to be carried, by index, in the order in which this program would map it.
    """
    others = []
    for number in _numbers(sheet, direction):
        try:
            return CarrierSearch(_as_described(sheet, direction, number, wanted), ())
        except (_Unusable, ConfigMismatch) as reason:
            others.append(f"0x{direction.communication + number:04X}: {reason}")
    refusals = []
    for number in _numbers(sheet, direction):
        try:
            return CarrierSearch(_mapped_here(sheet, direction, number, wanted), tuple(others))
        except _Unusable as reason:
            refusals.append(f"0x{direction.mapping + number:04X}: {reason}")
    return CarrierSearch(None, (*others, *refusals))


def cob_id_of(sheet: DataSheet, direction: Direction, number: int) -> int | None:
    """Give the identifier a PDO has in a run; None if there is none for it."""
    entry = sheet.entry(direction.communication + number, 1)
    value = None if entry is None else entry.value(sheet.node_id)
    first = direction.predefined(number)
    own = entry is not None and (entry.node_relative or sheet.commissioned_node == sheet.node_id)
    if own and value is not None and not value & COB_ID_EXTENDED:
        return value & 0x7FF
    return None if first is None else first + sheet.node_id


def strangers(sheet: DataSheet, carriers: Sequence[Carrier]) -> Iterator[int]:
    """Find other PDOs that would disturb, by the index of their communication parameter.

    These are PDOs that are on with the identifier of one in use, and TPDOs with a constant one: two drives with the
    same file would send it at the same moment.
    """
    used = {carrier.layout.communication_index for carrier in carriers}
    taken = {carrier.layout.cob_id for carrier in carriers}
    for direction in (RPDO, TPDO):
        for number in _numbers(sheet, direction):
            index = direction.communication + number
            entry = sheet.entry(index, 1)
            value = None if entry is None else entry.value(sheet.node_id)
            if index in used or entry is None or value is None or value & COB_ID_INVALID or not entry.writable:
                continue
            of_another = direction is TPDO and value & 0x7FF != cob_id_of(sheet, direction, number)
            if of_another or value & 0x7FF in taken:
                yield index


def _numbers(sheet: DataSheet, direction: Direction) -> Iterator[int]:
    for number in PDO_NUMBERS:
        if direction.communication + number in sheet.objects and direction.mapping + number in sheet.objects:
            yield number


def _described(sheet: DataSheet, direction: Direction, number: int) -> PdoLayout:
    """Read what the data sheet has.

    Raises
    ------
    _Unusable
        If it does not say it all, or it is a multiplexed PDO.
    """

    def read(index: int, subindex: int) -> int:
        value = sheet.value(index, subindex)
        if value is None:
            raise _Unusable(f"0x{index:04X}:{subindex:02X} without a value that can be read")
        if (index, subindex) == (mapping, 0) and value > MAX_OBJECTS:
            raise _Unusable(f"0x{index:04X}:00 is {value}: a multiplexed PDO")
        return value

    mapping = direction.mapping + number
    return read_layout(read, direction.communication + number, mapping)


def _as_described(sheet: DataSheet, direction: Direction, number: int, wanted: Sequence[int]) -> Carrier:
    described = _described(sheet, direction, number)
    carried = {mapped.index for mapped in described.objects if mapped.subindex == 0}
    more = {mapped.index for mapped in described.objects} - {*wanted, *FILLERS}
    if not set(wanted) <= carried or (direction is RPDO and more):
        raise _Unusable(str(described))
    for mapped in described.objects:
        _require_known(sheet, direction, mapped)
    if sum(mapped.length_bits for mapped in described.objects) > 8 * MAX_PDO_BYTES:
        raise _Unusable(f"{described}: more than {MAX_PDO_BYTES} bytes")
    return _carrier(sheet, direction, number, described.objects, described, mapped_here=False)


def _require_known(sheet: DataSheet, direction: Direction, mapped: MappedObject) -> None:
    entry = sheet.entry(mapped.index, mapped.subindex)
    kind = DATA_TYPES.get(mapped.index) if mapped.index in FILLERS else None if entry is None else entry.kind
    if kind is None or not kind.is_integer or kind.bits != mapped.length_bits or mapped.length_bits not in (8, 16, 32):
        raise _Unusable(f"maps {mapped}, expected an integer object of that length")
    if mapped.index in FILLERS and direction is TPDO:
        raise _Unusable(f"maps {mapped}, a filler")


def _mapped_here(sheet: DataSheet, direction: Direction, number: int, wanted: Sequence[int]) -> Carrier:
    mapping = direction.mapping + number
    objects = tuple(_mappable(sheet, direction, index) for index in wanted)
    if sum(mapped.length_bits for mapped in objects) > 8 * MAX_PDO_BYTES:
        raise _Unusable(f"more than {MAX_PDO_BYTES} bytes for {', '.join(map(str, objects))}")
    for n in range(len(objects) + 1):
        entry = sheet.entry(mapping, n)
        if entry is None or not entry.writable:
            raise _Unusable(f"0x{mapping:04X}:{n:02X} {'is not there' if entry is None else 'can not be written'}")
    try:
        described = _described(sheet, direction, number)
    except _Unusable:
        described = None
    return _carrier(sheet, direction, number, objects, described, mapped_here=True)


def _mappable(sheet: DataSheet, direction: Direction, index: int) -> MappedObject:
    entry = sheet.entry(index)
    if entry is None or entry.kind is None or entry.kind.bits is None:
        raise _Unusable(f"0x{index:04X} is not there, or of no known type")
    if not entry.mappable:
        raise _Unusable(f"0x{index:04X} has PDOMapping=0")
    if entry.access not in direction.access:
        raise _Unusable(f"0x{index:04X} has AccessType {entry.access}, which no {direction.name} carries")
    return MappedObject(index, 0, entry.kind.bits)


def _carrier(
    sheet: DataSheet,
    direction: Direction,
    number: int,
    objects: tuple[MappedObject, ...],
    described: PdoLayout | None,
    *,
    mapped_here: bool,
) -> Carrier:
    communication, mapping = direction.communication + number, direction.mapping + number
    places = [(communication, 1), (communication, 2), *((mapping, n) for n in range(len(objects) + 1))]
    entries = {place: sheet.entry(*place) for place in places}
    for place, entry in entries.items():
        _require_type(entry, place, communication)
    fixed = frozenset(place for place, entry in entries.items() if entry is None or not entry.writable)
    cob_id = cob_id_of(sheet, direction, number)
    if cob_id is None:
        raise _Unusable(f"no identifier in 0x{communication:04X}:01, and none in the pre-defined connection set")
    held = described is not None and described.valid and not described.extended and described.cob_id == cob_id
    if (communication, 1) in fixed and not held:
        raise _Unusable(f"0x{communication:04X}:01 can not be written and has not COB-ID 0x{cob_id:03X}, switched on")
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
        raise _Unusable(f"0x{index:04X}:{subindex:02X} {found}, expected {kind.name}")


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
    raise _Unusable(f"0x{communication:04X}:02 is {value} and can not be written, expected {EVERY_SYNC}")
