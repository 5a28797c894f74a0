"""One kind of fault of a simulated device, and the moment it comes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

F = TypeVar("F")


@dataclass(frozen=True, slots=True)
class Moment:
    """When a fault comes, in simulated time [s]; ``step`` is that SYNC, counted from 1."""

    at_s: float
    period_s: float

    @property
    def step(self) -> int:
        """Number of the SYNC at that time; 0 from power-on."""
        return round(self.at_s / self.period_s)


@dataclass(frozen=True, slots=True)
class Kind(Generic[F]):
    """One kind of fault: whether it comes at a moment, and what it does to a device's faults."""

    timed: bool
    put_into: Callable[[F, Moment], F]
