"""A transport delay as first in, first out: what went in comes out later, switched at the exact moment."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Piece:
    """A constant torque over a stretch of time."""

    torque_nm: float
    duration_s: float


class DelayLine:
    """Hold every torque back by a fixed time.

    Parameters
    ----------
    delay_s
        Time a torque spends in the line [s]; any fraction of a sample.
    """

    def __init__(self, delay_s: float) -> None:
        self._waiting: deque[Piece] = deque([Piece(0.0, delay_s)] if delay_s > 0.0 else [])

    def push(self, torque_nm: float, duration_s: float) -> list[Piece]:
        """Feed a torque for a time; return what comes out during that time, in order."""
        self._waiting.append(Piece(torque_nm, duration_s))
        leaving: list[Piece] = []
        left_s = duration_s
        while left_s > 0.0:
            first = self._waiting.popleft()
            if first.duration_s > left_s:
                self._waiting.appendleft(Piece(first.torque_nm, first.duration_s - left_s))
                first = Piece(first.torque_nm, left_s)
            leaving.append(first)
            left_s -= first.duration_s
        return leaving
