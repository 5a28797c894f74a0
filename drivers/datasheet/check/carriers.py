"""Rules for the two PDOs that carry the torque command and its feedback, whatever their numbers."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.canopen.pdo_map import (
    COB_ID_INVALID,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    PdoLayout,
)
from drivers.datasheet.check.context import SAMPLE_NODE_ID, EdsContext, at_file, at_key, at_section, hexadecimal
from drivers.datasheet.finding import EdsFinding, Severity
from drivers.datasheet.objects import EdsEntry
from drivers.datasheet.pdo import PdoSearch, find_pdo
from drivers.errors import ConfigMismatch
from drivers.inverter.pdos import COMMAND_OBJECTS, FEEDBACK_OBJECTS

RPDO_BASES = (RPDO_COMMUNICATION, RPDO_MAPPING)
TPDO_BASES = (TPDO_COMMUNICATION, TPDO_MAPPING)

EVERY_SYNC = 1
EVENT_DRIVEN = (254, 255)
"""Transmission types (CiA 301, 7.5.2.35)."""


def carrier_parameters(context: EdsContext) -> frozenset[int]:
    """Give the indices of the parameters of the two PDOs, as far as the file has them."""
    pdos = (_find(context, RPDO_BASES, COMMAND_OBJECTS), _find(context, TPDO_BASES, FEEDBACK_OBJECTS))
    layouts = [search.layout for search in pdos if search.layout is not None]
    return frozenset(index for each in layouts for index in (each.communication_index, each.mapping_index))


def check_carriers(context: EdsContext) -> Iterator[EdsFinding]:
    """Check that one RPDO and one TPDO carry what is needed, and can be configured."""
    yield from _rpdo(context)
    yield from _tpdo(context)


def _find(context: EdsContext, bases: tuple[int, int], indices: tuple[int, ...]) -> PdoSearch:
    def default(index: int, subindex: int) -> int:
        entry = context.entry(index, subindex)
        value = None if entry is None else entry.default(SAMPLE_NODE_ID)
        if value is None:
            raise ConfigMismatch(f"{hexadecimal(index, subindex)} without a readable DefaultValue")
        return value

    return find_pdo(lambda index: index in context.objects, default, bases, indices)


def _rpdo(context: EdsContext) -> Iterator[EdsFinding]:
    search = _find(context, RPDO_BASES, COMMAND_OBJECTS)
    if search.layout is None:
        yield _no_pdo(context, "RPDO", RPDO_BASES, COMMAND_OBJECTS, search)
        return
    yield from _configurable(context, search.layout)
    for n, mapped in enumerate(search.layout.objects, start=1):
        entry = context.entry(search.layout.mapping_index, n)
        if mapped.index not in COMMAND_OBJECTS and entry is not None:
            expected = f"{_names(COMMAND_OBJECTS)} alone in the RPDO that carries the torque"
            advice = "Take it out of the mapping in your copy of the EDS: there is no value for it."
            yield at_key(Severity.ERROR, entry.section, "DefaultValue", expected, "", advice)
    kind = context.entry(search.layout.communication_index, 2)
    if search.layout.transmission_type in EVENT_DRIVEN and kind is not None:
        advice = "Write 1 in your copy of the EDS to have it at SYNC."
        expected = "0 to 240, so that torque takes effect at SYNC"
        yield at_key(Severity.WARNING, kind.section, "DefaultValue", expected, "on arrival,", advice)


def _tpdo(context: EdsContext) -> Iterator[EdsFinding]:
    search = _find(context, TPDO_BASES, FEEDBACK_OBJECTS)
    if search.layout is None:
        yield _no_pdo(context, "TPDO", TPDO_BASES, FEEDBACK_OBJECTS, search)
        return
    yield from _configurable(context, search.layout)
    kind = context.entry(search.layout.communication_index, 2)
    if search.layout.transmission_type != EVERY_SYNC and kind is not None:
        advice = "Write 1 in your copy of the EDS: the drive is configured with it."
        expected = f"{EVERY_SYNC}, feedback at every SYNC"
        yield at_key(Severity.ERROR, kind.section, "DefaultValue", expected, "", advice)


def _no_pdo(
    context: EdsContext, name: str, bases: tuple[int, int], indices: tuple[int, ...], search: PdoSearch
) -> EdsFinding:
    expected = f"one {name} that maps {_names(indices)}"
    found = "; ".join(search.others) or f"no {name}"
    advice = "Map them in one PDO in your copy of the EDS; the drive is configured with it."
    first = context.objects.get(bases[1])
    if first is None:
        return at_file(Severity.ERROR, f"[{bases[1]:04X}]", expected, found, advice)
    return at_section(Severity.ERROR, first.section, expected, found, advice)


def _configurable(context: EdsContext, layout: PdoLayout) -> Iterator[EdsFinding]:
    """Find entries of a PDO that configuring writes and that the drive does not let be written."""
    written = [(layout.communication_index, 1), (layout.communication_index, 2), (layout.mapping_index, 0)]
    written += [(layout.mapping_index, n) for n in range(1, len(layout.objects) + 1)]
    for entry in (context.entry(*each) for each in written):
        if entry is not None and entry.access in ("ro", "const"):
            expected = f"{_name(entry)} that can be written, for the PDO is configured"
            advice = "A drive with a fixed PDO can't be used; look whether another PDO of it can be mapped."
            yield at_key(Severity.ERROR, entry.section, "AccessType", expected, "", advice)
    cob_id = context.entry(layout.communication_index, 1)
    if not layout.valid and cob_id is not None:
        expected = f"a PDO that is switched on (0x{COB_ID_INVALID:08X} clear)"
        advice = "It is switched on when the drive is configured; take the bit out to have hil check compare with that."
        yield at_key(Severity.WARNING, cob_id.section, "DefaultValue", expected, "one switched off,", advice)


def _name(entry: EdsEntry) -> str:
    return hexadecimal(entry.index, entry.subindex)


def _names(indices: tuple[int, ...]) -> str:
    return ", ".join(map(hexadecimal, indices))
