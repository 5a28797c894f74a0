"""A cable between two virtual channels that mistreats the frames it carries.

The host is on one channel, the simulated devices on the other. Each frame is treated in the thread that sends it,
but for those that are delayed. Chance is drawn per fault and COB-ID, so that the same seed mistreats the same
frames of a run however the heartbeats, which go by the wall clock, fall between them.
"""

from __future__ import annotations

import heapq
import itertools
import threading
import time
from collections.abc import Callable
from copy import copy
from typing import Self

import numpy as np

from drivers.canopen import can
from drivers.canopen.can_link import SYNC_COB_ID, is_canopen
from drivers.canopen.inline_bus import InlineBus
from hil.simulator.faults import AtStep, BusFaults, Frames

BUS_OFF_ERROR = 0x040  # error frame of a controller that has left the bus, as SocketCAN codes it

Deliver = Callable[[can.Message], None]


class Postman:
    """Delivers frames later, from a thread of its own, none of one direction before the one sent before it."""

    def __init__(self) -> None:
        self._queue: list[tuple[float, int, Deliver, can.Message]] = []
        self._numbers = itertools.count()
        self._changed = threading.Condition()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="delayed CAN frames", daemon=True)
        self._thread.start()

    def post(self, due_s: float, deliver: Deliver, message: can.Message) -> None:
        """Have a frame delivered at a time of the monotonic clock [s]."""
        with self._changed:
            heapq.heappush(self._queue, (due_s, next(self._numbers), deliver, message))
            self._changed.notify()

    def close(self) -> None:
        """End the thread; what was not delivered is lost."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while (due := self._next()) is not None:
            deliver, message = due
            deliver(message)

    def _next(self) -> tuple[Deliver, can.Message] | None:
        with self._changed:
            while not self._ended:
                wait_s = self._queue[0][0] - time.monotonic() if self._queue else None
                if wait_s is not None and wait_s <= 0.0:
                    _, _, deliver, message = heapq.heappop(self._queue)
                    return deliver, message
                self._changed.wait(wait_s)
        return None


class Lane:
    """One direction of the cable."""

    def __init__(
        self, faults: BusFaults, seed: int, step: Callable[[], int], deliver: Deliver, postman: Postman | None
    ) -> None:
        self._faults = faults
        self._seed = seed
        self._step = step
        self._deliver = deliver
        self._postman = postman
        self._chances: dict[tuple[int, int], np.random.Generator] = {}
        self._held: can.Message | None = None
        self._last_due_s = 0.0

    def carry(self, message: can.Message) -> None:
        """Take one frame to the other end, or not."""
        faults = self._faults
        if self._hit(1, faults.lose, message):
            return
        if self._hit(2, faults.corrupt, message):
            message = _shortened(message)
        if self._held is None and self._hit(3, faults.reorder, message):
            self._held = message
            return
        self._send(message)
        if self._hit(4, faults.repeat, message):
            self._send(message)
        held, self._held = self._held, None
        if held is not None:
            self._send(held)

    def _send(self, message: can.Message) -> None:
        due_s = time.monotonic() + self._lag_s(message)
        if self._postman is None:
            self._deliver(message)
            return
        self._last_due_s = max(due_s, self._last_due_s)  # a frame does not overtake
        self._postman.post(self._last_due_s, self._deliver, message)

    def _lag_s(self, message: can.Message) -> float:
        lag_s = 0.0
        if (delay := self._acting(self._faults.delay, message)) is not None:
            lag_s += delay
        if (jitter := self._acting(self._faults.jitter, message)) is not None:
            lag_s += jitter * self._chance(5, message.arbitration_id)
        return lag_s

    def _acting(self, since: AtStep[Frames] | None, message: can.Message) -> float | None:
        """Amount of a fault that touches this frame now."""
        if since is None or self._step() < since.step or not is_canopen(message):
            return None
        if not since.what.meant(message.arbitration_id):
            return None
        return since.what.amount

    def _hit(self, fault: int, since: AtStep[Frames] | None, message: can.Message) -> bool:
        share = self._acting(since, message)
        return share is not None and self._chance(fault, message.arbitration_id) < share

    def _chance(self, fault: int, cob_id: int) -> float:
        key = (fault, cob_id)
        if key not in self._chances:
            self._chances[key] = np.random.default_rng([self._seed, *key])
        return float(self._chances[key].random())


class FaultyWire:
    """The cable, from `__enter__` to `__exit__`."""

    def __init__(self, host_channel: str, device_channel: str, faults: BusFaults, seed: int) -> None:
        self._faults = faults
        self._syncs = 0
        self._off_reported = False
        self._postman = Postman() if faults.delay is not None or faults.jitter is not None else None
        self._host, self._device = InlineBus(host_channel), InlineBus(device_channel)
        self._to_devices = Lane(faults, seed, self._step, self._device.send, self._postman)
        self._to_host = Lane(faults, seed, self._step, self._host.send, self._postman)

    def __enter__(self) -> Self:
        self._host.receive_by(self._from_host)
        self._device.receive_by(self._from_devices)
        return self

    def __exit__(self, *_: object) -> None:
        if self._postman is not None:
            self._postman.close()
        self._host.shutdown()
        self._device.shutdown()

    def _step(self) -> int:
        return self._syncs

    def _from_host(self, message: can.Message) -> None:
        if message.arbitration_id == SYNC_COB_ID and is_canopen(message):
            self._syncs += 1
        if not self._off():
            self._to_devices.carry(message)

    def _from_devices(self, message: can.Message) -> None:
        if not self._off():
            self._to_host.carry(message)

    def _off(self) -> bool:
        """Whether the host's controller has left the bus; the first time the host is informed, as an adapter does."""
        off_at = self._faults.off_at_step
        if off_at is None or self._syncs < off_at:
            return False
        if not self._off_reported:
            self._off_reported = True
            self._host.send(can.Message(arbitration_id=BUS_OFF_ERROR, is_error_frame=True, data=bytes(8)))
        return True


def _shortened(message: can.Message) -> can.Message:
    """Take the last byte off a frame."""
    short = copy(message)
    short.data = message.data[:-1]
    short.dlc = len(short.data)
    return short
