"""Which PDOs carry what: one that maps it all, one that this program maps, or several. No bus.

A maker's own PDOs seldom carry torque command and feedback in one frame each. So the search continues to the first PDO
whose parameters can be written and whose mapping has room; the host maps it then at every configuration, in the order
of CiA 301, 7.5.2.36. Where no PDO takes it all, as with mappings that are fixed, several share it: CiA 402 itself
names such, each with controlword or statusword and one value more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from typing import Final

from drivers.canopen.pdo_map import COB_ID_INVALID
from drivers.capability.carrier import (
    PDO_NUMBERS,
    RPDO,
    TPDO,
    Carrier,
    Direction,
    ObjectId,
    Unusable,
    as_described,
    cob_id_of,
    map_here,
)
from drivers.datasheet.file import DataSheet
from drivers.errors import ConfigMismatch

MODES_OF_OPERATION: Final = 0x6060
"""What one of several RPDOs may carry too: its value is that of the whole run."""


@dataclass(frozen=True, slots=True)
class CarrierSearch:
    """What a search came to: the PDOs found, none if they do not carry it all, and others looked at, in words."""

    carriers: tuple[Carrier, ...]  # the PDOs, in their order
    others: tuple[str, ...] = ()  # PDOs that would not do, each with its reason

    def carries(self, index: int, subindex: int = 0) -> bool:
        """Tell whether one of the PDOs found carries an object."""
        return any(carrier.carries(index, subindex) for carrier in self.carriers)


def find_carriers(sheet: DataSheet, direction: Direction, *choices: Sequence[ObjectId]) -> CarrierSearch:
    """Find the PDOs that carry certain objects; one is better than several."""
    best, *_ = found = [_one(sheet, direction, wanted) for wanted in choices]
    one = next((search for search in found if search.carriers), None)
    if one is not None:
        return CarrierSearch(one.carriers, one.others or best.others)
    several = (_several(sheet, direction, wanted) for wanted in choices)
    return CarrierSearch(next(filter(None, several), ()), best.others)


def find_further(sheet: DataSheet, wanted: Sequence[ObjectId], used: Sequence[Carrier]) -> CarrierSearch:
    """Find the TPDOs that carry further objects, where those in ``used`` do not carry them; these stay as they are."""
    left = [each for each in wanted if not any(carrier.carries(*each) for carrier in used)]
    others = () if not left else _one(sheet, TPDO, left[:1]).others
    return CarrierSearch(_several(sheet, TPDO, left, used), others)


def interfering_pdos(sheet: DataSheet, carriers: Sequence[Carrier]) -> Iterator[int]:
    """Find other PDOs that would disturb, by the index of their communication parameter.

    These are PDOs that are on with the identifier of one in use, and TPDOs with a constant one: two drives with the
    same file would send it at the same moment.
    """
    used = {carrier.layout.communication_index for carrier in carriers}
    taken = {carrier.layout.cob_id for carrier in carriers}
    for direction in (RPDO, TPDO):
        for number in _numbers(sheet, direction):
            index = direction.communication + number
            entry, value = sheet.entry(index, 1), sheet.value(index, 1)
            if index in used or entry is None or value is None or value & COB_ID_INVALID or not entry.settable:
                continue
            of_another = direction is TPDO and value & 0x7FF != cob_id_of(sheet, direction, number)
            if of_another or value & 0x7FF in taken:
                yield index


def _numbers(sheet: DataSheet, direction: Direction) -> Iterator[int]:
    for number in PDO_NUMBERS:
        if direction.communication + number in sheet.objects and direction.mapping + number in sheet.objects:
            yield number


def _one(sheet: DataSheet, direction: Direction, wanted: Sequence[ObjectId]) -> CarrierSearch:
    """Find one PDO for all of it."""

    def described(number: int) -> Carrier:
        carrier = as_described(sheet, direction, number, wanted, _held(sheet, direction, number))
        if not all(carrier.carries(*each) for each in wanted):
            raise Unusable(str(carrier.described))
        return carrier

    def mapped(number: int) -> Carrier:
        return map_here(sheet, direction, number, wanted, _held(sheet, direction, number))

    numbers = list(_numbers(sheet, direction))
    first = _first(described, direction.communication, numbers)
    if first.carriers:
        return CarrierSearch(first.carriers)
    second = _first(mapped, direction.mapping, numbers)
    return CarrierSearch(second.carriers, first.others if second.carriers else (*first.others, *second.others))


def _first(take: Callable[[int], Carrier], base: int, numbers: Sequence[int]) -> CarrierSearch:
    """Take the first PDO that can be taken."""
    refused: list[str] = []
    for number in numbers:
        try:
            return CarrierSearch((take(number),), tuple(refused))
        except (Unusable, ConfigMismatch) as reason:
            refused.append(f"0x{base + number:04X}: {reason}")
    return CarrierSearch((), tuple(refused))


def _several(
    sheet: DataSheet, direction: Direction, wanted: Sequence[ObjectId], used: Sequence[Carrier] = ()
) -> tuple[Carrier, ...]:
    """Find PDOs, none of those used, that carry it together: each the one with the most of what is left.

    None if something is left. It may be one: an RPDO with the mode of operation in it is used if none can be mapped
    without.
    """
    left, chosen = list(wanted), list[Carrier]()
    while left:
        found = _parts(sheet, direction, wanted, left, [*used, *chosen])
        parts = [(sum(part.carries(*each) for each in left), part) for part in found]
        if not parts:
            return ()
        _, best = max(parts, key=itemgetter(0))  # the first of equals
        chosen.append(best)
        left = [each for each in left if not best.carries(*each)]
    return tuple(chosen)


def _parts(
    sheet: DataSheet,
    direction: Direction,
    wanted: Sequence[ObjectId],
    left: Sequence[ObjectId],
    chosen: Sequence[Carrier],
) -> Iterator[Carrier]:
    """List the PDOs that could carry some of what is left: as they are, or with as much of it mapped as fits."""
    used = {carrier.layout.communication_index for carrier in chosen}
    for number in _numbers(sheet, direction):
        if direction.communication + number in used:
            continue
        taken = _held(sheet, direction, number) | {carrier.layout.cob_id for carrier in chosen}
        ways = [
            partial(as_described, sheet, direction, number, wanted, taken, (MODES_OF_OPERATION,)),
            *(partial(map_here, sheet, direction, number, left[:n], taken) for n in range(len(left), 0, -1)),
        ]
        for way in ways:
            with suppress(Unusable, ConfigMismatch):
                carrier = way()
                if any(carrier.carries(*each) for each in left):
                    yield carrier
                    break


def _held(sheet: DataSheet, direction: Direction, but: int) -> set[int]:
    """List the identifiers of PDOs that are on and can't be switched off, but for the one of that number."""
    return {
        value & 0x7FF
        for each in (RPDO, TPDO)
        for number in _numbers(sheet, each)
        if (each, number) != (direction, but)
        and (entry := sheet.entry(each.communication + number, 1)) is not None
        and not entry.settable
        and (value := entry.value(sheet.node_id)) is not None
        and not value & COB_ID_INVALID
    }
