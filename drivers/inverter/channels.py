"""Further objects of an inverter, taken from its TPDOs: recorded, and never waited for by what commands a torque."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from drivers.canopen.pdo_map import PdoCodec
from drivers.capability.carrier import ObjectId


@dataclass(frozen=True, slots=True)
class _Received:
    """The values of one TPDO, and when it arrived on the host's monotonic clock [ns]."""

    values: tuple[int, ...]
    t_ns: int


NEVER_NS = -1
"""Before any clock's beginning."""

NOTHING = _Received((), NEVER_NS)


class ChannelReceiver:
    """Takes the TPDOs that carry further objects where frames are received; hands their counts to the caller's thread.

    Parameters
    ----------
    codecs
        Unpackers of the TPDOs.
    objects
        What is to be read of them.

    Raises
    ------
    ConfigMismatch
        If one of the objects is in none of them.
    """

    def __init__(self, codecs: Sequence[PdoCodec], objects: Sequence[ObjectId]) -> None:
        self._codecs = tuple(codecs)
        self._places = tuple(self._place(each) for each in objects)
        self._received = [NOTHING] * len(self._codecs)
        self._arrived = threading.Condition()
        self._started = False

    @property
    def subscriptions(self) -> list[tuple[int, Callable[[bytes, int], None]]]:
        """Identifier of each TPDO, and what takes its frames: data and arrival [ns]."""
        return [(codec.layout.cob_id, partial(self.on_frame, n)) for n, codec in enumerate(self._codecs)]

    def on_frame(self, part: int, data: bytes, t_ns: int) -> None:
        """Take the TPDO of that number; before `start_anew` its mapping is unknown, and it is left alone.

        Raises
        ------
        ProtocolViolation
            If it has not the length of its mapping.
        """
        if self._started:
            received = _Received(self._codecs[part].unpack(data), t_ns)
            with self._arrived:
                self._received[part] = received
                self._arrived.notify_all()

    def start_anew(self) -> None:
        """Take frames from now on, and forget those before: the mapping was another."""
        with self._arrived:
            self._started = True
            self._received = [NOTHING] * len(self._codecs)

    def await_after(self, after_ns: int, timeout_s: float) -> tuple[int | None, ...]:
        """Wait for all TPDOs that arrive after ``after_ns`` [ns], ``timeout_s`` at most [s].

        Returns
        -------
        tuple of int or None
            The count of each object; None for one whose TPDO did not arrive in time.
        """
        deadline = time.monotonic() + timeout_s
        with self._arrived:
            while any(received.t_ns <= after_ns for received in self._received):
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
        return received.values[at] if received.t_ns > after_ns else None

    def _place(self, wanted: ObjectId) -> tuple[int, int]:
        """Find an object: number of the TPDO, and place among its values."""
        carries = [
            any((each.index, each.subindex) == wanted for each in codec.layout.objects) for codec in self._codecs
        ]
        of = carries.index(True) if any(carries) else 0
        return of, self._codecs[of].position(*wanted)
