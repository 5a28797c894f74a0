"""JSON that someone else may have written: whatever is wrong with it is a ``ValueError``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

LARGEST_BYTES: Final = 32 << 20
"""Longest file that is read: empty lists alone then take 0.7 GiB."""


def read_json(path: Path) -> Any:
    """Return what a JSON file says.

    Raises
    ------
    ValueError
        As `parse_json`; if the file is no UTF-8, or longer than a program writes such files.
    OSError
        If it can't be read.
    """
    with path.open("rb") as file:
        content = file.read(LARGEST_BYTES + 1)
    if len(content) > LARGEST_BYTES:
        raise ValueError(f"more than {LARGEST_BYTES >> 20} MB")
    return parse_json(content.decode("utf-8"))


def parse_json(text: str) -> Any:
    """Return what a JSON text says.

    Raises
    ------
    ValueError
        If it is no JSON, is nested deeper than Python can follow, or has a whole number beyond 64 bit.
    """
    try:
        return json.loads(text, parse_int=_of_64_bit)
    except RecursionError:
        raise ValueError("values nested too deep") from None


def _of_64_bit(digits: str) -> int:
    """Return a whole number; a longer one is none of a count, and fits no float where it is divided."""
    value = int(digits)
    if not -(1 << 63) <= value < 1 << 63:
        raise ValueError(f"a whole number of {len(digits)} digits, expected at most 64 bit")
    return value
