"""Which PDO of an EDS carries given objects: the first that maps them all, whatever its number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivers.canopen.pdo_map import PdoLayout, ReadObject, read_layout
from drivers.errors import ConfigMismatch

PDO_NUMBERS = range(0x200)
"""Offsets of the up to 512 PDOs from 0x1400, 0x1600, 0x1800 and 0x1A00."""


@dataclass(frozen=True, slots=True)
class PdoSearch:
    """What a search came to.

    Attributes
    ----------
    layout
        The PDO found; None if none carries all the objects.
    others
        Those looked at before it, in words: layout, or why it can't be read.
    """

    layout: PdoLayout | None
    others: tuple[str, ...]


def find_pdo(
    has: Callable[[int], bool], default: ReadObject, bases: tuple[int, int], indices: tuple[int, ...]
) -> PdoSearch:
    """Find the first PDO that maps all the objects ``indices``.

    PDOs without readable defaults are no choice, but no hindrance: vendors leave those of spare PDOs blank.

    Parameters
    ----------
    has
        Whether the EDS has an object.
    default
        Gives an object's default value; raises `ConfigMismatch` without one.
    bases
        Indices of the first communication and of the first mapping parameter.
    indices
        Objects to be carried.
    """
    others = []
    for n in PDO_NUMBERS:
        communication, mapping = (base + n for base in bases)
        if not (has(communication) and has(mapping)):
            continue
        try:
            layout = read_layout(default, communication, mapping)
        except ConfigMismatch as unreadable:
            others.append(str(unreadable))
            continue
        if set(indices) <= {mapped.index for mapped in layout.objects}:
            return PdoSearch(layout, tuple(others))
        others.append(str(layout))
    return PdoSearch(None, tuple(others))
