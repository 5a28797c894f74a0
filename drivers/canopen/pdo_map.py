"""PDO communication and mapping parameters, and the frames they describe. No bus, no clock.

A layout is read from objects 0x1400/0x1600 (RPDO) or 0x1800/0x1A00 (TPDO) wherever they are: the defaults of
an EDS, a device over SDO, a simulated drive's own dictionary. One function reads all three, so they compare.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from drivers.errors import CommandRefused, ConfigMismatch, ProtocolViolation
from drivers.scaling import IntegerType

RPDO_COMMUNICATION = 0x1400
RPDO_MAPPING = 0x1600
TPDO_COMMUNICATION = 0x1800
TPDO_MAPPING = 0x1A00

COB_ID_INVALID = 1 << 31  # bit of the COB-ID entry that switches a PDO off (CiA 301, 7.5.2.35)

COB_ID_NO_RTR = 1 << 30
"""Bit by which a TPDO says that it can't be asked for by a remote frame; without meaning in an RPDO."""

COB_ID_EXTENDED = 1 << 29  # bit of an identifier of 29 bits, which this program neither sends nor hears

MAX_PDO_BYTES = 8

MAX_MAPPED = 64  # objects a PDO can map, one bit each (CiA 301, 7.5.2.36)

ReadObject = Callable[[int, int], int]
"""``read(index, subindex)``: the object's value, from wherever the caller has it."""

_STRUCT_CODES = {
    IntegerType.INTEGER8: "b",
    IntegerType.INTEGER16: "h",
    IntegerType.INTEGER32: "i",
    IntegerType.UNSIGNED8: "B",
    IntegerType.UNSIGNED16: "H",
    IntegerType.UNSIGNED32: "I",
}


@dataclass(frozen=True, slots=True)
class MappedObject:
    """One entry of a PDO mapping: index, subindex and length in bits."""

    index: int  # 0x1000 to 0xFFFF
    subindex: int  # 0 to 255
    length_bits: int  # 8, 16, 32 or 64 in practice

    @classmethod
    def from_entry(cls, entry: int) -> MappedObject:
        """Decode a mapping entry, ``0xIIIISSLL``."""
        return cls(entry >> 16, entry >> 8 & 0xFF, entry & 0xFF)

    @property
    def entry(self) -> int:
        """The mapping entry as objects 0x1600 and 0x1A00 hold it: index, subindex and bits in one 32-bit number."""
        return self.index << 16 | self.subindex << 8 | self.length_bits

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.subindex:02X} ({self.length_bits} bit)"


@dataclass(frozen=True, slots=True)
class PdoLayout:
    """A PDO as its objects describe it."""

    communication_index: int  # of its communication parameter, for example 0x1800
    mapping_index: int  # of its mapping parameter, for example 0x1A00
    cob_id: int  # CAN identifier
    valid: bool  # false if bit 31 of the COB-ID entry switches the PDO off
    transmission_type: int  # 1 to 240: at every n-th SYNC; 254, 255: event-driven
    objects: tuple[MappedObject, ...]  # mapped objects in the order of the frame
    extended: bool = False  # whether the identifier has 29 bits
    no_rtr: bool = field(default=False, compare=False)  # whether bit 30 forbids remote frames

    def __str__(self) -> str:
        mapped = ", ".join(map(str, self.objects)) or "nothing"
        state = (" (of 29 bits)" if self.extended else "") + ("" if self.valid else " (switched off)")
        return f"COB-ID 0x{self.cob_id:03X}{state}, transmission type {self.transmission_type}, maps {mapped}"


def read_layout(read: ReadObject, communication_index: int, mapping_index: int) -> PdoLayout:
    """Read one PDO's layout through ``read``."""
    cob_id = read(communication_index, 1)
    count = read(mapping_index, 0)
    if not 0 <= count <= MAX_MAPPED:
        raise ConfigMismatch(
            f"PDO mapping 0x{mapping_index:04X}:00: expected at most {MAX_MAPPED} objects (CiA 301), found {count}. "
            "Correct the count."
        )
    return PdoLayout(
        communication_index=communication_index,
        mapping_index=mapping_index,
        cob_id=cob_id & 0x7FF,
        valid=not cob_id & COB_ID_INVALID,
        transmission_type=read(communication_index, 2),
        objects=tuple(MappedObject.from_entry(read(mapping_index, n + 1)) for n in range(count)),
        extended=bool(cob_id & COB_ID_EXTENDED),
        no_rtr=bool(cob_id & COB_ID_NO_RTR),
    )


def configuration_writes(layout: PdoLayout, present: int) -> tuple[tuple[int, int, int], ...]:
    """List the writes ``(index, subindex, value)`` that give a device this layout.

    The order is that of CiA 301, 7.5.2.35 and 7.5.2.36: switch the PDO off and change no other bit of its COB-ID,
    set the number of mapped objects to 0, map, set the number, give it its identifier and switch it on. Bit 30 is
    the device's: many know no remote frames, and refuse an entry that allows them.
    """
    communication, mapping = layout.communication_index, layout.mapping_index
    no_rtr = present & COB_ID_NO_RTR | (COB_ID_NO_RTR if layout.no_rtr else 0)
    return (
        (communication, 1, present | COB_ID_INVALID),
        (communication, 2, layout.transmission_type),
        (mapping, 0, 0),
        *((mapping, n, mapped.entry) for n, mapped in enumerate(layout.objects, start=1)),
        (mapping, 0, len(layout.objects)),
        (communication, 1, layout.cob_id | no_rtr),
    )


class PdoCodec:
    """Packs and unpacks the frames of one PDO."""

    def __init__(self, layout: PdoLayout, types: Mapping[tuple[int, int], IntegerType], where: str) -> None:
        self.layout = layout
        self._where = f"{where}: PDO 0x{layout.communication_index:04X} (COB-ID 0x{layout.cob_id:03X})"
        if layout.extended:
            raise ConfigMismatch(
                f"{self._where} has an identifier of 29 bits (bit 29 of 0x{layout.communication_index:04X}:01), "
                "expected one of 11. Give the PDO such an identifier in the EDS."
            )
        self._types = tuple(self._type_of(mapped, types) for mapped in layout.objects)
        self._struct = struct.Struct("<" + "".join(_STRUCT_CODES[kind] for kind in self._types))
        if self._struct.size > MAX_PDO_BYTES:
            raise ConfigMismatch(
                f"{self._where} maps {self._struct.size} bytes, expected at most {MAX_PDO_BYTES}. "
                f"Correct the mapping in 0x{layout.mapping_index:04X}."
            )
        self.indices = tuple(mapped.index for mapped in layout.objects)
        self._positions = {(mapped.index, mapped.subindex): n for n, mapped in enumerate(layout.objects)}

    def _type_of(self, mapped: MappedObject, types: Mapping[tuple[int, int], IntegerType]) -> IntegerType:
        kind = types.get((mapped.index, mapped.subindex))
        if kind is None or kind.size_bytes * 8 != mapped.length_bits:
            expected = "an integer object of the EDS" if kind is None else f"{kind.size_bytes * 8} bit ({kind.name})"
            raise ConfigMismatch(
                f"{self._where} maps {mapped}, expected {expected}. "
                f"Correct the mapping in 0x{self.layout.mapping_index:04X} or the EDS."
            )
        return kind

    def position(self, index: int, subindex: int = 0) -> int:
        """Place of an object among the unpacked values."""
        if (index, subindex) not in self._positions:
            at = f":{subindex:02X}" if subindex else ""
            raise ConfigMismatch(
                f"{self._where} does not map 0x{index:04X}{at}, which is needed; it {self.layout}. "
                f"Map it in 0x{self.layout.mapping_index:04X} of the EDS."
            )
        return self._positions[index, subindex]

    def pack(self, values: tuple[int, ...]) -> bytes:
        """Build the frame's data from the objects' values, in mapping order."""
        try:
            return self._struct.pack(*values)
        except struct.error as error:
            raise CommandRefused(
                f"{self._where}: values {values} do not fit the objects "
                f"{', '.join(map(str, self.layout.objects))} ({error}). Nothing was sent; correct the values."
            ) from error

    def unpack(self, data: bytes) -> tuple[int, ...]:
        """Read the objects' values, in mapping order, from a frame's data."""
        if len(data) != self._struct.size:
            raise ProtocolViolation(
                f"{self._where}: frame of {len(data)} bytes, expected {self._struct.size} from the mapping "
                f"({', '.join(map(str, self.layout.objects))}). The device's mapping is not the EDS's; "
                "configure it again."
            )
        return self._struct.unpack(data)
