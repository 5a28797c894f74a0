"""An inverter's TPDOs as they arrive, turned into feedback and further objects, and the waiting for both.

Where several share the feedback it is as old as the oldest of them: who waits for what came after a SYNC gets it when
all of that cycle are there. Further objects are recorded, and never waited for by what commands a torque.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from drivers.canopen.pdo_map import PdoCodec
from drivers.capability.carrier import ObjectId
from drivers.inverter.cia402 import PowerState, StatusBit, state_of
from drivers.scaling import TorqueScale, VelocityScale

_LIMITED, _FOLLOWS = StatusBit.INTERNAL_LIMIT_ACTIVE.value, StatusBit.FOLLOWS_TARGET.value
"""As plain numbers, for one statusword in every cycle."""

NEVER_NS = -1  # before any clock's beginning


class Received(NamedTuple):
    """The values of one TPDO, and when it arrived on the host's monotonic clock [ns]."""

    values: tuple[int, ...]  # raw, in the order of the mapping
    t_ns: int  # host's monotonic clock [ns]


class InverterFeedback(NamedTuple):
    """What an inverter reported in its TPDOs."""

    torque_nm: float  # torque actual value, 0x6077 [Nm]
    speed_rad_s: float  # velocity actual value, 0x606C [rad/s]
    state: PowerState  # power state from the statusword, 0x6041
    t_ns: int  # when it arrived, host's monotonic clock [ns]
    torque_raw: int  # counts of 0x6077 on the bus, so that a wrong scale can be corrected later
    speed_raw: int  # counts of 0x606C, for the same
    limited: bool = False  # bit 11 of the statusword: the drive limits its torque
    follows: bool = True  # bit 12: the drive follows its target


class _TpdoReceiver:
    """Takes TPDOs where frames are received; the caller's thread is waked with `_arrived`."""

    def __init__(self, codecs: Sequence[PdoCodec]) -> None:
        self._codecs = tuple(codecs)
        self._received: list[Received | None] = [None] * len(self._codecs)
        self._arrived = threading.Condition()
        self._started = False

    @property
    def subscriptions(self) -> list[tuple[int, Callable[[bytes, int], None]]]:
        """Identifier of each TPDO, and what takes its frames: data and arrival [ns]."""
        return [(codec.layout.cob_id, partial(self.on_frame, n)) for n, codec in enumerate(self._codecs)]

    def on_frame(self, part: int, data: bytes, t_ns: int) -> None:
        """Take the TPDO of that number; before `start_anew` its mapping is unknown, and it is left alone."""
        if self._started:
            received = Received(self._codecs[part].unpack(data), t_ns)
            with self._arrived:
                self._received[part] = received
                self._take(part)
                self._arrived.notify_all()

    def start_anew(self) -> None:
        """Take frames from now on, and forget those before: mapping or state were other than now."""
        with self._arrived:
            self._started = True
            self._received = [None] * len(self._codecs)
            self._forget()

    def _take(self, part: int) -> None:
        """Do what follows from the TPDO of that number, while nobody reads."""

    def _forget(self) -> None:
        """Forget what followed from those before."""

    def _place(self, index: int, subindex: int = 0) -> tuple[int, int]:
        """Find an object: number of the TPDO, and place among its values."""
        wanted = (index, subindex)
        carries = [any((o.index, o.subindex) == wanted for o in codec.layout.objects) for codec in self._codecs]
        of = carries.index(True) if any(carries) else 0
        return of, self._codecs[of].position(index, subindex)


class FeedbackReceiver(_TpdoReceiver):
    """Hands the latest feedback of one inverter to the caller's thread."""

    def __init__(self, codecs: Sequence[PdoCodec], torque: TorqueScale, velocity: VelocityScale) -> None:
        super().__init__(codecs)
        self._torque = torque
        self._velocity = velocity
        self._places = tuple(self._place(index) for index in (0x6041, 0x6077, 0x606C))
        self._alone = tuple(at for _, at in self._places) if len(self._codecs) == 1 else None
        self._counts = [0] * len(self._codecs)
        self._taken = self._counts[:]
        self.latest: InverterFeedback | None = None

    def messages(self) -> tuple[int, int]:
        """How often the seldomest and the commonest kind of TPDO has come since this was last asked."""
        counts, before = self._counts[:], self._taken
        self._taken = counts
        if len(counts) == 1:
            got = counts[0] - before[0]
            return got, got
        came_each = [now - then for now, then in zip(counts, before, strict=True)]
        return min(came_each), max(came_each)

    def _take(self, part: int) -> None:
        """Make feedback of the TPDOs, once each has come."""
        self._counts[part] += 1
        received = self._received
        if self._alone is not None and received[0] is not None:
            values, t_ns = received[0]
            statusword, torque_raw, speed_raw = [values[at] for at in self._alone]
        else:
            all_received = [each for each in received if each is not None]
            if len(all_received) < len(self._codecs):
                return
            statusword, torque_raw, speed_raw = (all_received[n].values[at] for n, at in self._places)
            t_ns = min(each.t_ns for each in all_received)
        self.latest = InverterFeedback(
            self._torque.to_nm(torque_raw),
            self._velocity.to_rad_s(speed_raw),
            state_of(statusword),
            t_ns,
            torque_raw,
            speed_raw,
            statusword & _LIMITED != 0,
            statusword & _FOLLOWS != 0,
        )

    def _forget(self) -> None:
        self.latest = None
        self._taken = self._counts[:]

    def await_after(self, after_ns: int, timeout_s: float) -> InverterFeedback | None:
        """Wait for feedback that arrived after ``after_ns`` [ns]; None if there is none in time."""
        latest = self.latest
        if latest is not None and latest.t_ns > after_ns:
            return latest
        deadline = time.monotonic() + timeout_s
        with self._arrived:
            while self.latest is None or self.latest.t_ns <= after_ns:
                if not self._arrived.wait(deadline - time.monotonic()):
                    return None
            return self.latest


class ChannelReceiver(_TpdoReceiver):
    """Hands the counts of further objects to the caller's thread."""

    def __init__(self, codecs: Sequence[PdoCodec], objects: Sequence[ObjectId]) -> None:
        super().__init__(codecs)
        self._places = tuple(self._place(*each) for each in objects)

    def await_after(self, after_ns: int, timeout_s: float) -> tuple[int | None, ...]:
        """Wait for all TPDOs that arrive after ``after_ns`` [ns], ``timeout_s`` at most [s]."""
        deadline = time.monotonic() + timeout_s
        with self._arrived:
            while any(received is None or received.t_ns <= after_ns for received in self._received):
                if not self._arrived.wait(deadline - time.monotonic()):
                    break
            return tuple(self._count(place, after_ns) for place in self._places)

    @property
    def latest(self) -> tuple[int | None, ...]:
        """The last count of each object since `start_anew`; None for one that has not come."""
        return tuple(self._count(place, NEVER_NS) for place in self._places)

    def _count(self, place: tuple[int, int], after_ns: int) -> int | None:
        part, at = place
        received = self._received[part]
        return None if received is None or received.t_ns <= after_ns else received.values[at]
