"""A CiA 402 drive of which each habit can be changed, for the habits of real drives that the simulator has not.

Its objects are those of an EDS; it answers SDO, NMT and SYNC from its own code, not from the product's simulator. A
habit is a method that a test's subclass replaces. It lives on a virtual bus, in the threads of whoever sends.
"""

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from drivers.canopen.can_link import CanLink
from drivers.canopen.heartbeat import HeartbeatProducer, NmtState
from drivers.canopen.pdo_map import PdoCodec
from drivers.capability.carrier import RPDO, TPDO
from drivers.capability.plan import plan_drive
from drivers.datasheet.file import EdsFile
from drivers.inverter.cia402 import STATUSWORD_STATE_BITS, PowerState, StatusBit, command_of, next_state
from drivers.inverter.inverter import Inverter, InverterSettings
from drivers.inverter.pdos import codecs
from drivers.scaling import IntegerType
from tests.drivers.can_bench import M1, new_channel

FOLLOWS = StatusBit.FOLLOWS_TARGET

VALUE_RANGE, NO_SUCH_OBJECT, DEVICE_STATE = 0x06090030, 0x06020000, 0x08000022


class FakeDrive:
    """One drive on a bus of its own."""

    def __init__(self, link: CanLink, eds_path: Path | None = None, node_id: int = M1.node_id) -> None:
        self.link = link
        self.node_id = node_id
        self.eds = EdsFile(eds_path, node_id)
        self.types: dict[tuple[int, int], IntegerType] = self.eds.types()
        self.objects = {key: self.eds.sheet.value(*key) or 0 for key in self.types}
        self.objects |= {(0x6076, 0): round(M1.rated_torque_nm * 1000), (0x6502, 0): 0x3FF, (0x6072, 0): 3000}
        self.state = PowerState.SWITCH_ON_DISABLED
        self.nmt = NmtState.PRE_OPERATIONAL
        self.status_bits = StatusBit.REMOTE | StatusBit.VOLTAGE_ENABLED | FOLLOWS
        self.requests: list[bytes] = []
        self.controlword = 0
        self.torque = 0
        self.pending: dict[int, int] = {}
        self.rpdos, self.tpdos = (
            codecs(self.eds, plan_drive(self.eds.sheet).pdos(direction), "fake") for direction in (RPDO, TPDO)
        )
        self.producer: HeartbeatProducer | None = None
        link.subscribe(0x600 + node_id, lambda data, t_ns: self.take_sdo(data))
        link.subscribe(0x000, lambda data, t_ns: self.take_nmt(data[0]))
        link.subscribe(0x080, lambda data, t_ns: self.take_sync(data))
        for codec in self.rpdos:
            link.subscribe(codec.layout.cob_id, partial(self.take_rpdo, codec))

    # habits

    def refusal(self, index: int, subindex: int, value: int) -> int | None:
        """Abort code for a write, or None to take it."""
        return None

    def written(self, index: int, subindex: int, value: int) -> int:
        """What it makes of a value it takes."""
        return value

    def read(self, index: int, subindex: int) -> int:
        if (index, subindex) == (0x6041, 0):
            return self.statusword
        return self.torque if index == 0x6077 else self.objects[index, subindex]

    def answer(self, data: bytes) -> None:
        self.link.send(0x580 + self.node_id, data)

    def take_nmt(self, command: int) -> None:
        self.nmt = {1: NmtState.OPERATIONAL, 2: NmtState.STOPPED, 128: NmtState.PRE_OPERATIONAL}[command]

    def torque_of(self, target: int, offset: int) -> int:
        return target + offset

    def tpdos_sent(self) -> Sequence[PdoCodec]:
        """Which TPDOs go out at a SYNC, and in which order."""
        return self.tpdos

    def take_sync(self, data: bytes) -> None:
        if self.nmt is not NmtState.OPERATIONAL:
            return
        if self.pending:
            self.control(self.pending[0x6040])
            enabled = self.state is PowerState.OPERATION_ENABLED
            self.torque = self.torque_of(self.pending[0x6071], self.pending.get(0x60B2, 0)) if enabled else 0
        for codec in self.tpdos_sent():
            self.link.send(codec.layout.cob_id, codec.pack(tuple(self.read(i, 0) for i in codec.indices)))

    # what every drive does

    @property
    def statusword(self) -> int:
        return STATUSWORD_STATE_BITS[self.state] | self.status_bits

    def control(self, controlword: int) -> None:
        self.state = next_state(self.state, command_of(controlword, self.controlword))
        self.controlword = controlword

    def take_rpdo(self, codec: PdoCodec, data: bytes, t_ns: int) -> None:
        self.pending |= dict(zip(codec.indices, codec.unpack(data), strict=True))

    def take_sdo(self, request: bytes) -> None:
        self.requests.append(request)
        service, (index, subindex) = request[0] >> 5, struct.unpack("<HB", request[1:4])
        if service not in (1, 2):
            return
        kind = self.types.get((index, subindex))
        if kind is None:
            self.abort(request, NO_SUCH_OBJECT)
        elif service == 2:
            data = kind.encode(self.read(index, subindex), "fake")
            self.answer(bytes([0x43 | (4 - len(data)) << 2]) + request[1:4] + data.ljust(4, b"\0"))
        else:
            self.take_write(request, index, subindex, kind.decode(request[4 : 4 + kind.size_bytes]))

    def take_write(self, request: bytes, index: int, subindex: int, value: int) -> None:
        refusal = self.refusal(index, subindex, value)
        if refusal is not None:
            self.abort(request, refusal)
            return
        self.objects[index, subindex] = self.written(index, subindex, value)
        if index == 0x6040:
            self.control(value)
        elif index == 0x6060:
            self.objects[0x6061, 0] = self.objects[0x6060, 0]
        elif index == 0x1017 and value and self.producer is None:
            self.producer = HeartbeatProducer(self.link.send, self.node_id, value / 1000.0, lambda: self.nmt)
        self.answer(b"\x60" + request[1:4] + bytes(4))

    def abort(self, request: bytes, code: int) -> None:
        self.answer(b"\x80" + request[1:4] + code.to_bytes(4, "little"))

    def close(self) -> None:
        if self.producer is not None:
            self.producer.stop()


@contextmanager
def on_bus(
    drive_type: type[FakeDrive] = FakeDrive, settings: InverterSettings = M1, eds_path: Path | None = None
) -> Iterator[tuple[FakeDrive, Inverter, CanLink]]:
    """A drive, and the host's inverter on the same bus."""
    channel = new_channel()
    with CanLink.open(f"virtual:{channel}") as theirs, CanLink.open(f"virtual:{channel}") as ours:
        drive = drive_type(theirs, eds_path)
        try:
            yield drive, Inverter(ours, replace(settings, eds_path=eds_path)), ours
        finally:
            drive.close()
