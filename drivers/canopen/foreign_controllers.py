"""Another controller on the bus: a frame that comes in, with an identifier that only this program sends.

CAN hands no node its own frames. So a SYNC, an NMT command, the host's heartbeat, an RPDO or an SDO request to one of
the drives that *arrives* is somebody else's, and a torque may be too. It can't be distinguished from ours by the drive.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.errors import ForeignController

Subscribe = Callable[[int, Callable[[bytes, int], None]], None]


class Strangers:
    """Looks out for frames that only this program sends, while it drives."""

    def __init__(self, subscribe: Subscribe) -> None:
        self._subscribe = subscribe
        self._names: dict[int, str] = {}
        self._watching = False
        self._seen: str | None = None
        self.heard: str | None = None

    def claim(self, cob_id: int, what: str) -> None:
        """Take an identifier for this program's own; ``what`` names it in messages."""
        if cob_id not in self._names:
            self._subscribe(cob_id, lambda data, t_ns: self._on_frame(cob_id, data))
        self._names[cob_id] = what

    def watch(self) -> None:
        """Begin, and forget what came before: who configured the devices earlier does no harm."""
        if not self._watching:
            self._seen = None
        self._watching = True

    def end(self) -> None:
        """Look no more."""
        self._watching = False
        self._seen = None

    def raise_if_seen(self) -> None:
        """Raise if another controller's frame was seen, and say which."""
        if self._seen is not None:
            raise foreign(self._seen)

    def _on_frame(self, cob_id: int, data: bytes) -> None:
        if self.heard is not None and (self._seen is not None or not self._watching):
            return
        frame = f"{self._names[cob_id]} (frame 0x{cob_id:03X} [{data.hex(' ')}])"
        self.heard = self.heard or frame
        if self._watching:
            self._seen = frame


def foreign(frame: str) -> ForeignController:
    """Say that there is another controller, by a frame of its."""
    return ForeignController(
        f"{frame} came from somebody else on the bus, expected it from this program alone. Another controller commands "
        "the devices: end it, or unplug it, before you run again."
    )
