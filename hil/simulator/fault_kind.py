"""One kind of fault of a simulated device, the moment it comes, and the size it is asked for with.

A new fault is one entry in the table of its device: `INVERTER_KINDS`, `BUS_KINDS`, `PLC_KINDS`. The command line,
its help, the tests and the campaign read the tables.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

F = TypeVar("F")


@dataclass(frozen=True, slots=True)
class Moment:
    """When a fault comes, in simulated time [s], and its size; ``step`` is that SYNC, counted from 1."""

    at_s: float
    period_s: float
    size: Any = None

    @property
    def step(self) -> int:
        """Number of the SYNC at that time; 0 from power-on."""
        return round(self.at_s / self.period_s)


@dataclass(frozen=True, slots=True)
class Size:
    """What stands after the ``=`` of a fault.

    Attributes
    ----------
    sign
        How help and messages write it, such as ``CODE``.
    expected
        What it may be, in words, with its unit.
    read
        Reads it from text; raises ValueError for what it may not be.
    default
        What it is where nothing is written; None if it has to be.
    """

    sign: str
    expected: str
    read: Callable[[str], Any]
    default: Any = None


@dataclass(frozen=True, slots=True)
class Kind(Generic[F]):
    """One kind of fault.

    Attributes
    ----------
    timed
        Whether it comes at a moment; else it is there from the start.
    put_into
        What it does to a device's faults.
    size
        What it is asked for with; None for nothing.
    since_start
        Whether the moment may be left out: then it is the start.
    adds_up
        Whether it may come more than once, with other sizes.
    """

    timed: bool
    put_into: Callable[[F, Moment], F]
    size: Size | None = None
    since_start: bool = False
    adds_up: bool = False

    def written(self, name: str) -> str:
        """Write it as a person does: ``emcy@S=CODE``, in brackets what may be left out; S stands for seconds."""
        moment = "" if not self.timed else "[@S]" if self.since_start else "@S"
        if self.size is None:
            return name + moment
        size = f"={self.size.sign}"
        return name + moment + (size if self.size.default is None else f"[{size}]")
