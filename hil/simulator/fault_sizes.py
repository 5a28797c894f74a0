"""Sizes that faults are asked for with: numbers with a range, codes, objects, shares of frames."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from hil.simulator.fault_kind import Size

LAST_COB_ID = 0x7FF
PDO_COB_IDS = range(0x180, 0x580)
"""The PDOs of the predefined connection set (CiA 301)."""


@dataclass(frozen=True, slots=True)
class Frames:
    """Some of the frames of a bus, and by how much they are touched.

    Attributes
    ----------
    amount
        Share of them, 0 to 1, or a time [s].
    cob_id
        Which; None for all PDOs.
    """

    amount: float
    cob_id: int | None = None

    def meant(self, cob_id: int) -> bool:
        """Whether a frame is one of them."""
        return cob_id in PDO_COB_IDS if self.cob_id is None else cob_id == self.cob_id


def number(sign: str, low: float, high: float, unit: str = "", default: float | None = None) -> Size:
    """Describe a number from ``low`` to ``high``."""
    words = f"a number from {low:g} to {high:g} {unit}".rstrip()
    return Size(sign, words, _number_between(low, high), default)


def error_code(default: int | None = None) -> Size:
    """Describe an EMCY error code that is no reset of errors."""
    return Size("CODE", "an error code, 0x1000 to 0xFFFF", _whole_between(0x1000, 0xFFFF), default)


def index() -> Size:
    """Describe an object of the dictionary."""
    return Size("INDEX", "an object, 0x1000 to 0xFFFF", _whole_between(0x1000, 0xFFFF))


def frames(sign: str, high: float, unit: str) -> Size:
    """Describe an amount of the PDOs, or with ``:ID`` of the frames with one COB-ID."""
    words = f"a number from 0 to {high:g} {unit}, and :ID for frames of one COB-ID that are no PDO"
    return Size(f"{sign}[:ID]", words, lambda text: _frames(text, high))


def _number_between(low: float, high: float) -> Callable[[str], float]:
    def read(text: str) -> float:
        value = float(text)
        if not low <= value <= high or not math.isfinite(value):
            raise ValueError(text)
        return value

    return read


def _whole_between(low: int, high: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        value = int(text, 0)
        if not low <= value <= high:
            raise ValueError(text)
        return value

    return read


def _frames(text: str, high: float) -> Frames:
    amount, colon, cob_id = text.partition(":")
    which = _whole_between(0, LAST_COB_ID)(cob_id) if colon else None
    return Frames(_number_between(0.0, high)(amount), which)
