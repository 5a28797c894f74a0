"""The PDO parameters of a simulated node: the rules for writing them, and the PDOs they make."""

from __future__ import annotations

from drivers.canopen.pdo_map import (
    COB_ID_INVALID,
    MAX_PDO_BYTES,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    MappedObject,
    PdoCodec,
    PdoLayout,
    ReadObject,
    read_layout,
)
from drivers.datasheet.file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.inverter.drive_settings import RPDO_EVENT_TIMER
from hil.simulator.inverter_device import VALUE_RANGE_EXCEEDED, ObjectRefused

NOT_MAPPABLE = 0x06040041
LENGTH_EXCEEDED = 0x06040042
WRONG_DEVICE_STATE = 0x08000022
"""SDO abort codes."""

_PDOS = 0x200
_CYCLIC_TYPES = range(1, 241)
"""Transmission types this node knows: at every n-th SYNC."""


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
        for communication, mapping in (
            (RPDO_COMMUNICATION, RPDO_MAPPING),
            (TPDO_COMMUNICATION, TPDO_MAPPING),
        ):
            if communication <= index < communication + _PDOS and subindex == 2 and value not in _CYCLIC_TYPES:
                raise ObjectRefused(VALUE_RANGE_EXCEEDED)
            if mapping <= index < mapping + _PDOS:
                self._check_mapping(communication + index - mapping, index, subindex, value)

    def rpdos(self) -> tuple[PdoCodec, ...]:
        """Build the RPDOs that are switched on."""
        return self._codecs(RPDO_COMMUNICATION, RPDO_MAPPING)

    def tpdos(self) -> tuple[PdoCodec, ...]:
        """Build the TPDOs that are switched on."""
        return self._codecs(TPDO_COMMUNICATION, TPDO_MAPPING)

    def deadline_ms(self, rpdo: PdoLayout) -> int:
        """Read the event timer of an RPDO, its deadline [ms]; 0 is none."""
        index = rpdo.communication_index
        if self._eds.dictionary.get_variable(index, RPDO_EVENT_TIMER) is None:
            return 0
        return self._read(index, RPDO_EVENT_TIMER)

    def _check_mapping(self, communication: int, mapping: int, subindex: int, value: int) -> None:
        if not self._read(communication, 1) & COB_ID_INVALID:
            raise ObjectRefused(WRONG_DEVICE_STATE)
        if subindex == 0:
            self._check_length(mapping, value)
        elif self._read(mapping, 0) != 0:
            raise ObjectRefused(WRONG_DEVICE_STATE)
        else:
            self._check_entry(MappedObject.from_entry(value))

    def _check_length(self, mapping: int, count: int) -> None:
        entries = (MappedObject.from_entry(self._read(mapping, n + 1)) for n in range(count))
        if sum(entry.length_bits for entry in entries) > 8 * MAX_PDO_BYTES:
            raise ObjectRefused(LENGTH_EXCEEDED)

    def _check_entry(self, mapped: MappedObject) -> None:
        variable = self._eds.dictionary.get_variable(mapped.index, mapped.subindex)
        try:
            kind = self._eds.integer_type(mapped.index, mapped.subindex)
        except ConfigMismatch as error:
            raise ObjectRefused(NOT_MAPPABLE) from error
        if variable is None or not variable.pdo_mappable or 8 * kind.size_bytes != mapped.length_bits:
            raise ObjectRefused(NOT_MAPPABLE)

    def _codecs(self, communication_base: int, mapping_base: int) -> tuple[PdoCodec, ...]:
        layouts = (
            read_layout(self._read, communication_base + n, mapping_base + n)
            for n in range(_PDOS)
            if self._eds.has(communication_base + n) and self._eds.has(mapping_base + n)
        )
        where = f"simulated node {self._eds.node_id}"
        return tuple(self._eds.codec(layout, where) for layout in layouts if layout.valid and not layout.extended)
