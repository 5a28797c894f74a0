"""The object dictionary of a simulated drive, from its EDS: SDO server, PDO mapping and frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import canopen
from canopen.sdo.exceptions import SdoAbortedError

from drivers.canopen.heartbeat import NMT_COB_ID
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
from drivers.capability.plan import plan_drive
from drivers.capability.speed_unit import described_scale, speed_scale
from drivers.capability.table import EVENT_TIMER
from drivers.datasheet.file import EdsFile
from drivers.datasheet.types import DATA_TYPES
from drivers.scaling import IntegerType, VelocityScale
from hil.simulator.drive_physics import SimulatedInverter
from hil.simulator.faults import InverterFaults
from hil.simulator.inverter_device import PARAMETERS, VALUE_RANGE_EXCEEDED, ObjectRefused

NO_SUCH_OBJECT = 0x06020000
READ_ONLY = 0x06010002
NO_VALUE = 0x060A0023  # SDO abort codes
_DOWNLOAD, _UPLOAD = 1, 2  # client command specifiers of the requests that name an object (CiA 301, 7.2.4.3)

_ABORT = 0x80

_REQUEST_BYTES = 8

NOT_MAPPABLE = 0x06040041
LENGTH_EXCEEDED = 0x06040042
WRONG_DEVICE_STATE = 0x08000022  # SDO abort codes

EVENT_DRIVEN = range(254, 256)
ACYCLIC = 0
"""Transmission types: at an event, and at the SYNC after one; 1 to 240 are every n-th SYNC (CiA 301, 7.5.2.35)."""

_KNOWN_TYPES = (*range(241), *EVENT_DRIVEN)
_COB_ID_BITS = (1 << 30) - 1

MAX_TORQUE = 0x6072
SUPPORTED_MODES = 0x6502

INTEGERS = frozenset(IntegerType)  # data types that are simulated by value


class ObjectServer(canopen.LocalNode):
    """The library's node, with the hooks it offers, but without its NMT slave."""

    def __init__(
        self,
        node_id: int,  # Node id
        eds: EdsFile,  # Its objects
        faults: InverterFaults,  # Objects it forgets, lacks or locks
        on_read: Callable[..., int | None],  # Called with ``index``, ``subindex``, ``od`` and, for a write, ``data``
        on_write: Callable[..., None],  # Called with ``index``, ``subindex``, ``od`` and, for a write, ``data``
    ) -> None:
        super().__init__(node_id, eds.dictionary)
        self._eds = eds
        self.ignored_writes = faults.ignored_writes
        self._missing = faults.missing_objects
        self._locked = faults.locked_objects
        self._read_callbacks = [on_read]
        self._write_callbacks = [on_write]

    def associate_network(self, network: canopen.Network) -> None:
        """Join a network; what is received comes through `answer`."""
        super().associate_network(network)
        network.unsubscribe(self.sdo.rx_cobid, self.sdo.on_request)
        network.unsubscribe(NMT_COB_ID, self.nmt.on_command)

    def answer(self, request: bytes, t_ns: int) -> None:
        """Answer one SDO request; a shorter frame is none (CiA 301, 7.2.4.3) and is passed over."""
        if len(request) < _REQUEST_BYTES:
            return
        service, index = request[0] >> 5, int.from_bytes(request[1:3], "little")
        if service in (_DOWNLOAD, _UPLOAD) and index in self._missing:
            self._refuse(request, NO_SUCH_OBJECT)
        elif service == _DOWNLOAD and index in self._locked:
            self._refuse(request, READ_ONLY)
        else:
            sdo: Any = self.sdo  # the library's server has no types
            sdo.on_request(self.sdo.rx_cobid, request, t_ns)

    def get_data(self, index: int, subindex: int, check_readable: bool = False) -> bytes:
        """Read an object; a number without a value is 0, as in a drive whose memory was cleared."""
        entry = self._eds.sheet.entry(index, subindex)
        value: bytes
        try:
            value = super().get_data(index, subindex, check_readable)
        except SdoAbortedError as error:
            if error.code != NO_VALUE or entry is None or entry.kind is None or entry.kind.bits is None:
                raise
            value = bytes((entry.kind.bits + 7) // 8)
        return value

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """Write an object, unless it is one that forgets."""
        if index not in self.ignored_writes:
            super().set_data(index, subindex, data, check_writable)

    def _refuse(self, request: bytes, abort_code: int) -> None:
        answer = bytes((_ABORT, *request[1:4])) + abort_code.to_bytes(4, "little")
        self.network.send_message(self.sdo.tx_cobid, answer)


Read = Callable[[], int]


@dataclass(frozen=True, slots=True)
class PdoFrame:
    """One PDO's frames."""

    layout: PdoLayout  # The PDO
    signed: tuple[bool, ...]  # Whether each mapped object may be negative

    @property
    def bits(self) -> int:
        """Length of all mapped objects together."""
        return sum(mapped.length_bits for mapped in self.layout.objects)

    @property
    def size_bytes(self) -> int:
        """Length of a frame; above 8 it does not fit."""
        return (self.bits + 7) // 8

    @property
    def fits(self) -> bool:
        """Whether a CAN frame can hold it."""
        return self.size_bytes <= MAX_PDO_BYTES

    def pack(self, values: Sequence[int]) -> bytes:
        """Build a frame; of a value that is too long the upper bits are lost, as in a drive."""
        number, at = 0, 0
        for mapped, value in zip(self.layout.objects, values, strict=True):
            number |= (value & (1 << mapped.length_bits) - 1) << at
            at += mapped.length_bits
        return number.to_bytes(self.size_bytes, "little")

    def unpack(self, data: bytes) -> list[tuple[MappedObject, int]]:
        """Read the objects' values from a frame of the right length."""
        number, found = int.from_bytes(data, "little"), []
        for mapped, signed in zip(self.layout.objects, self.signed, strict=True):
            value = number & (1 << mapped.length_bits) - 1
            number >>= mapped.length_bits
            negative = signed and value >> mapped.length_bits - 1
            found.append((mapped, value - (1 << mapped.length_bits) if negative else value))
        return found


class PdoObjects:
    """Objects 0x1400 to 0x1BFF of one node."""

    def __init__(self, eds: EdsFile, read: ReadObject) -> None:
        self._eds = eds
        self._read = read

    def check_write(self, index: int, subindex: int, value: int) -> None:
        """Check a new value of any object; those that are no PDO parameter pass."""
        for direction in (RPDO, TPDO):
            if index - direction.communication in PDO_NUMBERS:
                self._check_communication(index, subindex, value)
            if index - direction.mapping in PDO_NUMBERS:
                communication = direction.communication + index - direction.mapping
                self._check_mapping(direction, communication, index, subindex, value)

    def rpdos(self) -> tuple[PdoFrame, ...]:
        """Return the RPDOs that are valid and mapped now."""
        return tuple(self._frames(RPDO))

    def tpdos(self) -> tuple[PdoFrame, ...]:
        """Return the TPDOs that are valid and mapped now."""
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


def power_on_values(eds: EdsFile) -> dict[int, int]:
    """Power-on values of what the device holds, from the EDS where it has them."""
    described = {index: eds.sheet.value(index) for index in (*PARAMETERS, SUPPORTED_MODES)}
    known = {index: value for index, value in described.items() if value is not None}
    if not known.get(MAX_TORQUE):
        known.pop(MAX_TORQUE, None)  # a place left free: no drive is made to give no torque
    return {**PARAMETERS, **known}


def velocity_scale(eds: EdsFile, settings: SimulatedInverter) -> VelocityScale:
    """Scale of its speed: its EDS's, else what the rig file states of it."""
    plan = plan_drive(eds.sheet)
    where = f"simulated inverter, node {settings.node_id}"
    return described_scale(plan, where) or speed_scale(plan, settings.speed_unit, where)


def fitting(value: int, data_type: int) -> int:
    """Give a value in the range of its object: makers have narrower ones than CiA 402."""
    if data_type not in INTEGERS:
        return value
    kind = IntegerType(data_type)
    return min(max(value, kind.low), kind.high)
