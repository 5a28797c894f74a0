"""The frames of one cycle by python-can alone: two participants of its virtual bus, no drivers, no drives."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can

RPDOS, SYNC, TPDOS = (0x201, 0x202), 0x080, (0x181, 0x182)
RPDO_BYTES, TPDO_BYTES = 6, 8

Exchange = Callable[[int], None]
"""``exchange(count)``: so many cycles, one after the other."""


@contextmanager
def raw_exchange() -> Iterator[Exchange]:
    """Open the bus, and yield what sends and receives two RPDOs, SYNC and two TPDOs, all in one thread."""
    channel = str(uuid.uuid4())
    with _participant(channel) as host, _participant(channel) as drives:

        def exchange(count: int) -> None:
            for _ in range(count):
                for cob_id in RPDOS:
                    host.send(_frame(cob_id, RPDO_BYTES))
                host.send(_frame(SYNC, 0))
                _receive(drives, len(RPDOS) + 1)
                for cob_id in TPDOS:
                    drives.send(_frame(cob_id, TPDO_BYTES))
                _receive(host, len(TPDOS))

        yield exchange


def _participant(channel: str) -> can.BusABC:
    return can.Bus(interface="virtual", channel=channel, ignore_config=True)


def _frame(cob_id: int, size_bytes: int) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=bytes(size_bytes), is_extended_id=False)


def _receive(bus: can.BusABC, count: int) -> None:
    for _ in range(count):
        if bus.recv(1.0) is None:
            raise TimeoutError("a frame of the raw exchange did not arrive within 1 s")
