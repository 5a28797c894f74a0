"""Rules for PDOs: parameters in pairs, identifiers, mappings of objects that are there, mappable and fit.

Then rules for the two that carry the torque command and its feedback, whatever their numbers.
"""

from __future__ import annotations

from collections.abc import Iterator

from drivers.canopen.pdo_map import COB_ID_EXTENDED, COB_ID_INVALID, MAX_MAPPED, MAX_PDO_BYTES, MappedObject
from drivers.canopen.sdo import object_name
from drivers.capability.carrier import FILLERS, MULTIPLEX, PDO_NUMBERS, RPDO, TPDO, Carrier, Direction, is_reserved
from drivers.capability.carrier_search import CarrierSearch
from drivers.capability.plan import COMMAND, FEEDBACK, wanted_names
from drivers.capability.table import Function
from drivers.datasheet.objects import EdsEntry, EdsObject
from drivers.datasheet.text import EdsFinding, Severity
from drivers.datasheet.types import read_number
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section

_AS_MAPPED = "The maker's own mapping counts."


def check_pdos(context: EdsContext) -> Iterator[EdsFinding]:
    """Yield what is wrong with the PDOs of a file: communication, mapping, identifiers that are given twice."""
    for direction in (RPDO, TPDO):
        for n in PDO_NUMBERS:
            yield from _pair(context, direction, direction.communication + n, direction.mapping + n)
    yield from _same_cob_ids(context)


def _pair(context: EdsContext, direction: Direction, communication: int, mapping: int) -> Iterator[EdsFinding]:
    for one, other in ((communication, mapping), (mapping, communication)):
        if one in context.objects and other not in context.objects:
            expected = f"0x{other:04X} next to it, for a {direction.name} has both"
            advice = "Describe both; this PDO is not used."
            yield at_section(Severity.WARNING, context.objects[one].section, expected, "none", advice)
    if communication in context.objects:
        yield from _cob_id(context, communication)
    if mapping in context.objects:
        yield from _mapping(context, direction, context.objects[mapping])


def _cob_id(context: EdsContext, communication: int) -> Iterator[EdsFinding]:
    entry = context.entry(communication, 1)
    value = None if entry is None else entry.value(context.node_id)
    if entry is None or value is None:
        return
    given = {carrier.layout.communication_index: carrier.layout.cob_id for carrier in context.plan.carriers}
    used, switched_on = communication in given, not value & COB_ID_INVALID
    replaced = used and given[communication] != value & (COB_ID_EXTENDED | 0x7FF)
    severity = Severity.WARNING if replaced else context.severity(communication)
    if value & COB_ID_EXTENDED and (switched_on or used):
        expected = "an identifier of 11 bits (bit 29 clear)"
        yield at_key(severity, entry.section, entry.value_key, expected, "", "Give the PDO one.")
    elif switched_on and is_reserved(value & 0x7FF):
        expected = "an identifier a PDO may have, such as 0x181 to 0x57F (CiA 301)"
        found = f"0x{value & 0x7FF:03X} for node {context.node_id} from"
        yield at_key(severity, entry.section, entry.value_key, expected, found, "Give the PDO another.")


def _mapping(context: EdsContext, direction: Direction, described: EdsObject) -> Iterator[EdsFinding]:
    zero = described.entries.get(0)
    count = None if zero is None else zero.value(context.node_id)
    if zero is None or not count or count in MULTIPLEX:
        return
    severity, bits = context.severity(described.index), 0
    if not 0 < count <= MAX_MAPPED:
        expected = f"at most {MAX_MAPPED} mapped objects (CiA 301)"
        yield at_key(severity, zero.section, "DefaultValue", expected, "", "Correct the count.")
        return
    for n in range(1, count + 1):
        entry = described.entries.get(n)
        value = None if entry is None else entry.value(context.node_id)
        if entry is None or value is None:
            section = described.section if entry is None else entry.section
            expected = f"a mapped object in sub-index {n}, for sub-index 0 counts {count}"
            yield at_section(severity, section, expected, "none", "Correct the count, or give it a DefaultValue.")
            continue
        mapped = MappedObject.from_entry(value)
        bits += mapped.length_bits
        yield from _mapped(context, direction, entry, mapped, severity)
    if bits > 8 * MAX_PDO_BYTES:
        expected = f"at most {MAX_PDO_BYTES} bytes mapped"
        yield at_section(severity, described.section, expected, f"{bits / 8:g}", "Map fewer objects.")


def _mapped(
    context: EdsContext, direction: Direction, entry: EdsEntry, mapped: MappedObject, severity: Severity
) -> Iterator[EdsFinding]:
    if mapped.index in FILLERS:
        yield from _dummy(context, direction, entry, mapped, severity)
        return
    name = object_name(mapped.index, mapped.subindex)
    target = context.entry(mapped.index, mapped.subindex)
    advice = f"Correct this mapping or the description of {name}."
    if target is None or target.kind is None:
        expected = "the index, sub-index and length of an object described"
        yield at_key(severity, entry.section, entry.value_key, expected, f"{name}, which is not, in", advice)
        return
    line = f"line {target.section.line}"
    if target.kind.bits != mapped.length_bits:
        expected = f"{target.kind.bits} bit for {name} ({target.kind.name}, {line})"
        found = f"{mapped.length_bits} bit in"
        yield at_key(severity, entry.section, entry.value_key, expected, found, advice)
    if not target.mappable:
        expected = f"an object with PDOMapping=1; {name} ({line}) has not"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", f"{advice} {_AS_MAPPED}")
    if target.access is not None and target.access not in direction.access:
        expected = f"an object a {direction.name} may carry; {name} ({line}) has AccessType {target.access}"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", f"{advice} {_AS_MAPPED}")


def _dummy(
    context: EdsContext, direction: Direction, entry: EdsEntry, mapped: MappedObject, severity: Severity
) -> Iterator[EdsFinding]:
    section = context.text.section("DummyUsage")
    key = f"Dummy{mapped.index:04d}"
    allowed = section is not None and read_number(section.get(key) or "0") == 1
    if direction.name != "RPDO" or not allowed:
        expected = f"a filler in an RPDO only, with {key}=1 under [DummyUsage]"
        yield at_key(severity, entry.section, entry.value_key, expected, "", "Take it out of the mapping.")


def _same_cob_ids(context: EdsContext) -> Iterator[EdsFinding]:
    seen: dict[int, EdsEntry] = {}
    given = {carrier.layout.communication_index: carrier.layout.cob_id for carrier in context.plan.carriers}
    for direction in (RPDO, TPDO):
        for n in PDO_NUMBERS:
            entry = context.entry(direction.communication + n, 1)
            value = None if entry is None else entry.value(context.node_id)
            if entry is None or value is None or value & COB_ID_INVALID:
                continue
            first = seen.setdefault(value & 0x7FF, entry)
            if first is not entry:
                both = {given.get(each.index) for each in (first, entry)}  # in a run; a third PDO is switched off
                severity = Severity.ERROR if len(both) == 1 and None not in both else Severity.WARNING
                expected = f"another identifier than 0x{first.index:04X} (line {first.section.line})"
                yield at_key(
                    severity, entry.section, entry.value_key, expected, "", "Switch one off, or give it another."
                )


def check_carriers(context: EdsContext) -> Iterator[EdsFinding]:
    """Check that RPDOs and TPDOs carry what is needed, or can be made to."""
    plan = context.plan
    yield from _search(context, RPDO, COMMAND, plan.command)
    yield from _search(context, TPDO, FEEDBACK, plan.feedback)
    for index in plan.pdos_to_disable:
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
            expected = f"{object_name(*place)} that can be written"
            advice = "It is not written: the drive has to hold what stands here."
            yield at_key(Severity.NOTE, entry.section, "AccessType", expected, "", advice)
            return
