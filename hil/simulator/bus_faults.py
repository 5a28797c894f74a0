"""What is wrong with a simulated CAN bus, and the names by which it can be asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

from hil.simulator.fault_kind import Kind
from hil.simulator.fault_sizes import Frames, frames


@dataclass(frozen=True, slots=True)
class Since:
    """Frames that are touched from one SYNC on, counted from 1; 0 is the start."""

    frames: Frames
    step: int


@dataclass(frozen=True, slots=True)
class BusFaults:
    """What is wrong with the bus; by default nothing.

    Attributes
    ----------
    lose
        Share of frames that do not arrive.
    corrupt
        Share of frames that arrive one byte short, as from a faulty gateway: CAN's own CRC lets no wrong frame
        through.
    repeat
        Share of frames that arrive twice.
    reorder
        Share of frames that the next one overtakes.
    delay, jitter
        Time of the wall clock that frames take, fixed, or random up to that [s].
    off_at_step
        The host's CAN controller leaves the bus at this SYNC.
    """

    lose: Since | None = None
    corrupt: Since | None = None
    repeat: Since | None = None
    reorder: Since | None = None
    delay: Since | None = None
    jitter: Since | None = None
    off_at_step: int | None = None


def _touching(field: str, sign: str, high: float, unit: str) -> Kind[BusFaults]:
    return Kind(
        True,
        lambda faults, when: replace(faults, **{field: Since(when.size, when.step)}),
        frames(sign, high, unit),
        since_start=True,
    )


BUS_KINDS: Final[Mapping[str, Kind[BusFaults]]] = MappingProxyType(
    {
        **{name: _touching(name, "SHARE", 1.0, "of all") for name in ("lose", "corrupt", "repeat", "reorder")},
        **{name: _touching(name, "SECONDS", 10.0, "s") for name in ("delay", "jitter")},
        "off": Kind(True, lambda faults, when: replace(faults, off_at_step=when.step)),
    }
)
