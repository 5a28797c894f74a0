"""The TPDOs of an inverter as they arrive: what both its feedback and its further objects are taken from."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from drivers.canopen.pdo_map import PdoCodec


@dataclass(frozen=True, slots=True)
class Received:
    """The values of one TPDO, and when it arrived on the host's monotonic clock [ns]."""

    values: tuple[int, ...]
    t_ns: int


class TpdoReceiver:
    """Takes TPDOs where frames are received; the caller's thread is waked with `_arrived`.

    Parameters
    ----------
    codecs
        Unpackers of the TPDOs.
    """

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
        """Take the TPDO of that number; before `start_anew` its mapping is unknown, and it is left alone.

        Raises
        ------
        ProtocolViolation
            If it has not the length of its mapping, or holds what no drive may send.
        """
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
        """Find an object: number of the TPDO, and place among its values.

        Raises
        ------
        ConfigMismatch
            If it is in none of them.
        """
        wanted = (index, subindex)
        carries = [any((o.index, o.subindex) == wanted for o in codec.layout.objects) for codec in self._codecs]
        of = carries.index(True) if any(carries) else 0
        return of, self._codecs[of].position(index, subindex)
