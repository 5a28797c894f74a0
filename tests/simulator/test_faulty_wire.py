"""The cable that mistreats frames: what leaves at one end against what arrives at the other."""

import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import can
import pytest

from drivers.canopen.inline_bus import InlineBus
from hil.simulator.faults import AtStep, BusFaults, Frames
from hil.simulator.faulty_wire import BUS_OFF_ERROR, FaultyWire
from tests.drivers.can_bench import frame

TPDO, SDO, SYNC = 0x185, 0x585, 0x080


@dataclass
class Ends:
    """A host and a device at the ends of one cable, and what each has received."""

    host: can.BusABC
    device: can.BusABC
    at_host: list[can.Message] = field(default_factory=list)
    at_device: list[can.Message] = field(default_factory=list)

    def from_device(self, count: int, cob_id: int = TPDO) -> list[int]:
        """Send so many numbered frames; the numbers that arrived."""
        for k in range(count):
            self.device.send(frame(cob_id, bytes((k, 0))))
        return [message.data[0] for message in self.at_host if message.arbitration_id == cob_id]


@contextmanager
def cable(faults: BusFaults, seed: int = 1) -> Iterator[Ends]:
    host_channel, device_channel = str(uuid.uuid4()), str(uuid.uuid4())
    host, device = InlineBus(host_channel), InlineBus(device_channel)
    ends = Ends(host, device)
    host.receive_by(ends.at_host.append)
    device.receive_by(ends.at_device.append)
    with FaultyWire(host_channel, device_channel, faults, seed):
        yield ends
    host.shutdown()
    device.shutdown()


def some(amount: float, cob_id: int | None = None, step: int = 0) -> AtStep[Frames]:
    return AtStep(step, Frames(amount, cob_id))


def test_a_sound_cable_carries_everything_both_ways() -> None:
    with cable(BusFaults()) as ends:
        assert ends.from_device(5) == [0, 1, 2, 3, 4]
        ends.host.send(frame(0x205, b"\1\2\3"))
        assert [(message.arbitration_id, bytes(message.data)) for message in ends.at_device] == [(0x205, b"\1\2\3")]


def test_a_frame_of_another_protocol_is_no_pdo_and_no_sync() -> None:
    """Its 29-bit identifier has the number of one: it arrives whole, and no time passes by it."""
    with cable(BusFaults(lose=some(1.0, TPDO), off_at_step=1)) as ends:
        for number in (SYNC, TPDO):
            ends.host.send(can.Message(arbitration_id=number, data=b"\1", is_extended_id=True))
            ends.device.send(can.Message(arbitration_id=number, data=b"\1", is_extended_id=True))
        assert [message.arbitration_id for message in ends.at_device] == [SYNC, TPDO]
        assert [message.arbitration_id for message in ends.at_host] == [SYNC, TPDO]


def test_lost_frames_are_as_many_as_asked_for_and_the_same_for_the_same_seed() -> None:
    arrived = []
    for seed in (1, 1, 2):
        with cable(BusFaults(lose=some(0.2)), seed) as ends:
            arrived.append([ends.from_device(100) for _ in range(2)][-1])
    assert arrived[0] == arrived[1] != arrived[2]
    assert 120 < len(arrived[0]) < 190  # 200 draws of 0.8: outside with a chance below 1e-5


def test_repeated_frames_come_twice_in_a_row() -> None:
    with cable(BusFaults(repeat=some(1.0))) as ends:
        assert ends.from_device(3) == [0, 0, 1, 1, 2, 2]


def test_reordered_frames_are_overtaken_by_the_next() -> None:
    with cable(BusFaults(reorder=some(1.0))) as ends:
        assert ends.from_device(6) == [1, 0, 3, 2, 5, 4]


@pytest.mark.parametrize("faults", [BusFaults(delay=some(0.02)), BusFaults(jitter=some(0.02))])
def test_delayed_frames_come_later_and_in_their_order(faults: BusFaults) -> None:
    with cable(faults) as ends:
        assert ends.from_device(20) != list(range(20))
        while len(ends.at_host) < 20:  # the timeout of the test ends it otherwise
            time.sleep(0.002)
        assert [message.data[0] for message in ends.at_host] == list(range(20))


def test_a_controller_off_the_bus_is_reported_once_and_nothing_passes_any_more() -> None:
    with cable(BusFaults(off_at_step=1)) as ends:
        assert ends.from_device(1) == [0]
        for _ in range(3):
            ends.host.send(frame(SYNC, b""))
        assert ends.at_device == []
        assert ends.from_device(2) == [0]
        [reported] = [message for message in ends.at_host if message.is_error_frame]
        assert reported.arbitration_id == BUS_OFF_ERROR
