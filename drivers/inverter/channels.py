"""Further objects of an inverter, taken from its TPDOs: recorded, and never waited for by what commands a torque."""

from __future__ import annotations

import time
from collections.abc import Sequence

from drivers.canopen.pdo_map import PdoCodec
from drivers.capability.carrier import ObjectId
from drivers.inverter.tpdos import TpdoReceiver

NEVER_NS = -1
"""Before any clock's beginning."""


class ChannelReceiver(TpdoReceiver):
    """Hands the counts of further objects to the caller's thread.

    Parameters
    ----------
    codecs
        Unpackers of the TPDOs that carry them.
    objects
        What is to be read of them.

    Raises
    ------
    ConfigMismatch
        If one of the objects is in none of them.
    """

    def __init__(self, codecs: Sequence[PdoCodec], objects: Sequence[ObjectId]) -> None:
        super().__init__(codecs)
        self._places = tuple(self._place(*each) for each in objects)

    def await_after(self, after_ns: int, timeout_s: float) -> tuple[int | None, ...]:
        """Wait for all TPDOs that arrive after ``after_ns`` [ns], ``timeout_s`` at most [s].

        Returns
        -------
        tuple of int or None
            The count of each object; None for one whose TPDO did not arrive in time.
        """
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
