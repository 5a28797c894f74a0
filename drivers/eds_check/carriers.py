"""Rules for the two PDOs that carry the torque command and its feedback, whatever their numbers."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.canopen.pdo_map import COB_ID_EXTENDED, COB_ID_INVALID
from drivers.capability.carrier import RPDO, TPDO, Carrier, Direction, is_reserved
from drivers.capability.carrier_search import CarrierSearch
from drivers.capability.function import Function
from drivers.capability.plan import COMMAND, FEEDBACK, wanted_names
from drivers.datasheet.finding import EdsFinding, Severity
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section, hexadecimal


def check_carriers(context: EdsContext) -> Iterator[EdsFinding]:
    """Check that RPDOs and TPDOs carry what is needed, or can be made to."""
    plan = context.plan
    yield from _search(context, RPDO, COMMAND, plan.command)
    yield from _search(context, TPDO, FEEDBACK, plan.feedback)
    for index in plan.strangers:
        entry = context.entry(index, 1)
        if entry is not None:
            expected = "an identifier by the node id ($NODEID+0x...), for two drives with this file send the same"
            advice = "A run switches this PDO off."
            yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", advice)


def _search(
    context: EdsContext, direction: Direction, functions: tuple[Function, ...], search: CarrierSearch
) -> Iterator[EdsFinding]:
    wanted = wanted_names(context.plan, functions)
    if not search.carriers:
        yield _no_pdo(context, direction, wanted, search)
    for carrier in search.carriers:
        if carrier.mapped_here:
            yield from _mapped_here(context, direction, wanted, carrier)
        else:
            yield from _as_described(context, carrier)


def _no_pdo(context: EdsContext, direction: Direction, wanted: str, search: CarrierSearch) -> EdsFinding:
    expected = f"one {direction.name} or several that map {wanted}, or that can be mapped"
    found = "; ".join(search.others) or f"no {direction.name}"
    advice = "Map them in one PDO in your copy of the EDS, if the drive can be configured so."
    for index in (direction.mapping, direction.communication):
        if index in context.objects:
            return at_section(Severity.ERROR, context.objects[index].section, expected, found, advice)
    listed = context.text.section("OptionalObjects")
    place = f"[{direction.mapping:04X}]"
    if listed is None:
        return at_file(Severity.ERROR, place, expected, found, advice)
    return EdsFinding(Severity.ERROR, listed.line, place, expected, found, advice)


def _mapped_here(context: EdsContext, direction: Direction, wanted: str, carrier: Carrier) -> Iterator[EdsFinding]:
    section = context.objects[carrier.layout.mapping_index].section
    found = "nothing that can be read" if carrier.described is None else f"[{carrier.described}]"
    advice = f"A run maps it: [{carrier.layout}]."
    yield at_section(Severity.NOTE, section, f"one {direction.name} that maps {wanted}", found, advice)


def _as_described(context: EdsContext, carrier: Carrier) -> Iterator[EdsFinding]:
    layout, described = carrier.layout, carrier.described
    kind = context.entry(layout.communication_index, 2)
    if kind is not None and described is not None and described.transmission_type != layout.transmission_type:
        expected = f"{layout.transmission_type}, at every SYNC"
        yield at_key(Severity.WARNING, kind.section, kind.value_key, expected, "", "A run gives it this value.")
    cob_id = context.entry(layout.communication_index, 1)
    value = None if cob_id is None else cob_id.value(context.node_id)
    if cob_id is not None and value is not None and value & (COB_ID_EXTENDED | 0x7FF) != layout.cob_id:
        if value & COB_ID_EXTENDED or is_reserved(value & 0x7FF):
            return  # said with the other PDOs
        expected = f"$NODEID+0x{layout.cob_id - context.node_id:X}, for this is a constant"
        yield at_key(Severity.WARNING, cob_id.section, cob_id.value_key, expected, "", "A run gives it this value.")
    if cob_id is not None and described is not None and not described.valid:
        expected = f"a PDO that is switched on (0x{COB_ID_INVALID:08X} clear)"
        advice = "It is switched on when the drive is configured."
        yield at_key(Severity.WARNING, cob_id.section, cob_id.value_key, expected, "one switched off,", advice)
    for place in sorted(carrier.fixed):
        entry = context.entry(*place)
        if entry is not None:
            expected = f"{hexadecimal(*place)} that can be written"
            advice = "It is not written: the drive has to hold what stands here."
            yield at_key(Severity.NOTE, entry.section, "AccessType", expected, "", advice)
            return
