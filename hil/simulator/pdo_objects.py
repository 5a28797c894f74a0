"""The PDO parameters of a simulated node: the rules for writing them, and the PDOs they make."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.canopen.pdo_map import (
    COB_ID_INVALID,
    MAX_MAPPED,
    MAX_PDO_BYTES,
    MappedObject,
    PdoLayout,
    ReadObject,
    read_layout,
)
from drivers.capability.carrier import FILLERS, PDO_NUMBERS, RPDO, TPDO, Direction, is_reserved
from drivers.capability.table import EVENT_TIMER
from drivers.datasheet.file import EdsFile
from drivers.datasheet.types import DATA_TYPES
from hil.simulator.inverter_device import VALUE_RANGE_EXCEEDED, ObjectRefused
from hil.simulator.pdo_frame import PdoFrame

NOT_MAPPABLE = 0x06040041
LENGTH_EXCEEDED = 0x06040042
WRONG_DEVICE_STATE = 0x08000022
"""SDO abort codes."""

EVENT_DRIVEN = range(254, 256)
ACYCLIC = 0
"""Transmission types: at an event, and at the SYNC after one; 1 to 240 are every n-th SYNC (CiA 301, 7.5.2.35)."""

_KNOWN_TYPES = (*range(241), *EVENT_DRIVEN)
_COB_ID_BITS = (1 << 30) - 1


class PdoObjects:
    """Objects 0x1400 to 0x1BFF of one node.

    Parameters
    ----------
    eds
        The node's EDS, for data types and what may be mapped.
    read
        Reads the node's own objects.
    """

    def __init__(self, eds: EdsFile, read: ReadObject) -> None:
        self._eds = eds
        self._read = read

    def check_write(self, index: int, subindex: int, value: int) -> None:
        """Check a new value of any object; those that are no PDO parameter pass.

        Raises
        ------
        ObjectRefused
            If the order of CiA 301, 7.5.2.36 is not kept, or the PDO can't be made.
        """
        for direction in (RPDO, TPDO):
            if index - direction.communication in PDO_NUMBERS:
                self._check_communication(index, subindex, value)
            if index - direction.mapping in PDO_NUMBERS:
                communication = direction.communication + index - direction.mapping
                self._check_mapping(direction, communication, index, subindex, value)

    def rpdos(self) -> tuple[PdoFrame, ...]:
        """Build the RPDOs that are switched on."""
        return tuple(self._frames(RPDO))

    def tpdos(self) -> tuple[PdoFrame, ...]:
        """Build the TPDOs that are switched on."""
        return tuple(self._frames(TPDO))

    def deadline_ms(self, rpdo: PdoLayout) -> int:
        """Read the event timer of an RPDO, its deadline [ms]; 0 is none."""
        index = rpdo.communication_index
        return 0 if self._eds.sheet.entry(index, EVENT_TIMER) is None else self._read(index, EVENT_TIMER)

    def _check_communication(self, index: int, subindex: int, value: int) -> None:
        if subindex == 2 and value not in _KNOWN_TYPES:
            raise ObjectRefused(VALUE_RANGE_EXCEEDED)
        if subindex == 1:
            before = self._read(index, 1)
            both_on = not (before | value) & COB_ID_INVALID
            if both_on and (before ^ value) & _COB_ID_BITS:  # an identifier is changed while the PDO is off
                raise ObjectRefused(VALUE_RANGE_EXCEEDED)

    def _check_mapping(self, direction: Direction, communication: int, mapping: int, subindex: int, value: int) -> None:
        cob_id = self._eds.sheet.entry(communication, 1)
        can_be_switched_off = cob_id is not None and cob_id.writable  # else the number of objects, 0, does it
        if can_be_switched_off and not self._read(communication, 1) & COB_ID_INVALID:
            raise ObjectRefused(WRONG_DEVICE_STATE)
        if subindex == 0:
            self._check_length(mapping, value)
        elif self._read(mapping, 0) != 0:
            raise ObjectRefused(WRONG_DEVICE_STATE)
        else:
            self._check_entry(direction, MappedObject.from_entry(value))

    def _check_length(self, mapping: int, count: int) -> None:
        entries = (MappedObject.from_entry(self._read(mapping, n + 1)) for n in range(count))
        if sum(entry.length_bits for entry in entries) > 8 * MAX_PDO_BYTES:
            raise ObjectRefused(LENGTH_EXCEEDED)

    def _check_entry(self, direction: Direction, mapped: MappedObject) -> None:
        if direction is RPDO and mapped.index in FILLERS:
            return
        entry = self._eds.sheet.entry(mapped.index, mapped.subindex)
        bits = None if entry is None or entry.kind is None else entry.kind.bits
        if entry is None or not entry.mappable or bits != mapped.length_bits:
            raise ObjectRefused(NOT_MAPPABLE)

    def _frames(self, direction: Direction) -> Iterator[PdoFrame]:
        """Build the PDOs of a direction; one that can't be made is as good as switched off."""
        for number in PDO_NUMBERS:
            communication, mapping = direction.communication + number, direction.mapping + number
            if not (self._there(communication, 1) and self._there(mapping, 0)):
                continue
            if self._read(mapping, 0) > MAX_MAPPED:  # a multiplexed PDO, or none
                continue
            frame = self._frame(read_layout(self._read_or_nothing, communication, mapping))
            usable = frame.layout.valid and not frame.layout.extended and not is_reserved(frame.layout.cob_id)
            if usable and frame.layout.objects and frame.fits:
                yield frame

    def _frame(self, layout: PdoLayout) -> PdoFrame:
        return PdoFrame(layout, tuple(self._signed(mapped) for mapped in layout.objects))

    def _signed(self, mapped: MappedObject) -> bool:
        entry = self._eds.sheet.entry(mapped.index, mapped.subindex)
        kind = DATA_TYPES.get(mapped.index) if entry is None else entry.kind
        return kind is not None and kind.signed

    def _there(self, index: int, subindex: int) -> bool:
        return self._eds.sheet.entry(index, subindex) is not None

    def _read_or_nothing(self, index: int, subindex: int) -> int:
        """Read a parameter; one the data sheet does not list is 0."""
        return self._read(index, subindex) if self._there(index, subindex) else 0
