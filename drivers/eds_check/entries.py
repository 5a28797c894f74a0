"""Rules for the description of each object: what kind it is, its sub-indices, its data type and access, its numbers.

Of numbers: defaults that can be read and fit, limits, octal numbers, formulas with the node id.
"""

from __future__ import annotations

from collections.abc import Iterator

from drivers.datasheet.file import read_octets, read_real
from drivers.datasheet.objects import (
    ACCESS_TYPES,
    SUB_SECTION,
    EdsEntry,
    EdsObject,
    ObjectType,
    object_type,
    sub_sections,
)
from drivers.datasheet.text import EdsFinding, EdsSection, Severity
from drivers.datasheet.types import DATA_TYPES, OCTET_STRING, DataType, octal_matters, read_formula, read_number
from drivers.eds_check.context import EdsContext, at_key, at_section

PRE_DEFINED_ERROR_FIELD = 0x1003
"""Its sub-index 0 counts the errors there are, not the sub-indices."""

STRUCTURE = 0xFF
"""Sub-index that describes the object itself (CiA 301, 7.4.3); no entry of it."""

MAX_COMPACT = 254

_TYPES = ", ".join(f"0x{kind:X} ({kind.name})" for kind in (ObjectType.VAR, ObjectType.ARRAY, ObjectType.RECORD))
_NUMBERED_VALUES = (ObjectType.VAR, ObjectType.ARRAY, ObjectType.RECORD, ObjectType.DOMAIN)


def check_entries(context: EdsContext) -> Iterator[EdsFinding]:
    """Check each object and each of its sub-indices."""
    subs = sub_sections(context.text)
    for described in context.objects.values():
        yield from _object(context, described, len(subs.get(described.index, ())))
        if described.object_type in _NUMBERED_VALUES:
            for entry in described.entries.values():
                yield from _entry(context, entry)
    yield from _blank_mappings(context)


def _object(context: EdsContext, described: EdsObject, subs: int) -> Iterator[EdsFinding]:
    section, severity = described.section, context.severity(described.index)
    if section.get("ParameterName") is None:
        yield at_key(Severity.WARNING, section, "ParameterName", "a name (CiA 306)", "none", "Add one.")
    if described.object_type is None:
        yield at_key(severity, section, "ObjectType", f"one of {_TYPES}", "", "Take the maker's file.")
        return
    if described.object_type.has_entries:
        if section.get("ObjectType") is None:
            expected, advice = "0x8 (ARRAY) or 0x9 (RECORD), since it has sub-indices", "Read as RECORD; write it."
            yield at_key(Severity.WARNING, section, "ObjectType", expected, "none", advice)
        yield from _group(context, described, subs)
    elif subs:
        expected = "ObjectType 0x8 (ARRAY) or 0x9 (RECORD), since it has sub-indices"
        yield at_key(Severity.WARNING, section, "ObjectType", expected, "", "Correct it; the sub-indices are not read.")
    elif read_number(section.get("SubNumber") or "0"):
        expected = "no sub-indices of an object that is no ARRAY or RECORD"
        yield at_key(Severity.WARNING, section, "SubNumber", expected, "", "Take it out, or correct ObjectType.")


def _group(context: EdsContext, described: EdsObject, subs: int) -> Iterator[EdsFinding]:
    section, severity = described.section, context.severity(described.index)
    if not described.entries:
        yield at_section(severity, section, "sub-indices, or CompactSubObj", "none", "Describe them.")
        return
    if section.get("CompactSubObj") is not None:
        yield from _compact(context, section)
    elif read_number(section.get("SubNumber") or "") != subs:
        found = "none" if section.get("SubNumber") is None else ""
        expected = f"{subs}, the sub-indices described"
        yield at_key(Severity.WARNING, section, "SubNumber", expected, found, "Correct it; all described are read.")
    if 0 not in described.entries:
        yield at_section(Severity.WARNING, section, "a sub-index 0, the highest one", "none", "Describe it.")
    else:
        yield from _highest(described, described.entries[0], context.node_id)


def _compact(context: EdsContext, section: EdsSection) -> Iterator[EdsFinding]:
    count = read_number(section.get("CompactSubObj") or "")
    severity = context.severity(int(section.name, 16))
    if count is None or not 0 <= count <= MAX_COMPACT:
        yield at_key(severity, section, "CompactSubObj", f"a number from 0 to {MAX_COMPACT}", "", "Correct it.")
        return
    if count and read_number(section.get("SubNumber") or "0"):
        advice = "Leave one; both are read, a sub-index described counts before CompactSubObj."
        yield at_key(Severity.WARNING, section, "SubNumber", "0 next to CompactSubObj", "", advice)
    names = context.text.section(f"{section.name}Name")
    named = None if names is None else read_number(names.get("NrOfEntries") or "")
    if names is not None and (named is None or named > count):
        yield at_key(Severity.WARNING, names, "NrOfEntries", f"at most {count}, CompactSubObj", "", "Correct it.")


def _highest(described: EdsObject, zero: EdsEntry, node_id: int) -> Iterator[EdsFinding]:
    """Compare sub-index 0 with the highest there is, where it is a constant and not a count that is set."""
    highest = max(n for n in described.entries if n != STRUCTURE)
    value = zero.value(node_id)
    constant = zero.access in ("const", "ro") and described.index != PRE_DEFINED_ERROR_FIELD
    if value is not None and (value > highest or (constant and value != highest)):
        expected = f"{highest}, the highest sub-index described"
        yield at_key(Severity.WARNING, zero.section, zero.value_key, expected, "", "Correct one of the two.")


def _entry(context: EdsContext, entry: EdsEntry) -> Iterator[EdsFinding]:
    section, severity = entry.section, context.severity(entry.index)
    match = SUB_SECTION.fullmatch(section.name.lower())
    if match is not None and section.get("ParameterName") is None:
        yield at_key(Severity.WARNING, section, "ParameterName", "a name (CiA 306)", "none", "Add one.")
    if match is not None and object_type(section, has_entries=False) not in (ObjectType.VAR, ObjectType.DOMAIN):
        expected = "0x7 (VAR) for a sub-index"
        yield at_key(Severity.WARNING, section, "ObjectType", expected, "", "Correct it; it is read as VAR.")
    if entry.kind is None:
        known = f"0x{min(DATA_TYPES):04X} to 0x{max(DATA_TYPES):04X}"
        found = "none" if section.get("DataType") is None else ""
        advice = "The entry is left out; correct it."
        yield at_key(severity, section, "DataType", f"a data type of CiA 301, {known}", found, advice)
    if entry.access is None and object_type(section, has_entries=False) is not ObjectType.DOMAIN:
        found = "none" if section.get("AccessType") is None else ""
        expected = f"one of {', '.join(ACCESS_TYPES)}"
        yield at_key(severity, section, "AccessType", expected, found, "Take it from the drive's manual.")
    mapping = section.get("PDOMapping")
    if mapping is not None and read_number(mapping) not in (0, 1):
        yield at_key(severity, section, "PDOMapping", "0 or 1", "", "Write 1 if a PDO may carry it.")


def _blank_mappings(context: EdsContext) -> Iterator[EdsFinding]:
    """Say once that PDOMapping is blank: some editors leave it so in every sub-index 0."""
    blank = [
        section
        for section in context.text.sections.values()
        if (key := section.keys.get("pdomapping")) is not None and not key.value
    ]
    if blank:
        many = "" if len(blank) == 1 else f", and {len(blank) - 1} more"
        yield at_key(
            Severity.WARNING, blank[0], "PDOMapping", "0 or 1", f"a blank here{many}", "Read as 0; write 0 or 1."
        )


_LIMITS = ("LowLimit", "HighLimit")
_TEXT_KEYS = ("parametername", "denotation", "defaultvalue", "parametervalue", "accesstype")


def check_values(context: EdsContext) -> Iterator[EdsFinding]:
    """Check the numbers of every value of the object dictionary."""
    for described in context.objects.values():
        seen = set()
        for entry in described.entries.values():
            if entry.section.line not in seen:  # those of CompactSubObj share one section
                seen.add(entry.section.line)
                yield from _numbers(context, entry)
                if entry.kind is not None:
                    yield from _value(context, entry, entry.kind)


def _numbers(context: EdsContext, entry: EdsEntry) -> Iterator[EdsFinding]:
    """Find numbers whose leading 0 changes them, or makes them none."""
    is_integer = entry.kind is not None and entry.kind.is_integer
    for name, key in entry.section.keys.items():
        if (name not in _TEXT_KEYS or (name == "defaultvalue" and is_integer)) and octal_matters(key.value):
            value = read_number(key.value)
            found = "no octal number" if value is None else f"octal, {value}:"
            expected = "a number without a leading 0, which makes it octal (CiA 306)"
            severity = context.severity(entry.index) if value is None else Severity.WARNING
            yield at_key(severity, entry.section, key.name, expected, found, "Write it in decimal or as 0x.")


def _value(context: EdsContext, entry: EdsEntry, kind: DataType) -> Iterator[EdsFinding]:
    if not kind.is_integer:
        yield from _other_value(context, entry, kind)
        return
    severity = context.severity(entry.index)
    expected = f"a number of {kind.name}, {kind.low} to {kind.high}"
    if entry.value_text is not None:
        if entry.value(context.node_id) is None and not octal_matters(entry.value_text):
            yield at_key(
                severity, entry.section, entry.value_key, expected, "", "Write one that fits, or leave it blank."
            )
        yield from _formula(entry)
    for key in _LIMITS:
        if entry.section.get(key) is not None and entry.limit(key, context.node_id) is None:
            yield at_key(Severity.WARNING, entry.section, key, expected, "", "It is left out; correct it.")
    yield from _within_limits(context, entry)


def _other_value(context: EdsContext, entry: EdsEntry, kind: DataType) -> Iterator[EdsFinding]:
    text = entry.value_text
    if text is None:
        return
    if kind.is_real and read_real(text) is None:
        yield at_key(Severity.WARNING, entry.section, entry.value_key, f"a number ({kind.name})", "", "Correct it.")
    elif kind.code == OCTET_STRING and read_octets(text) is None:
        expected = "pairs of hexadecimal digits (OCTET_STRING)"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", "It is left out; correct it.")


def _formula(entry: EdsEntry) -> Iterator[EdsFinding]:
    formula = read_formula(entry.value_text or "")
    if formula is not None and formula.of_node_id and not formula.node_id_first:
        expected = f"$NODEID+0x{formula.constant:X}, the node id in front (CiA 306)"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", "Read so; turn it round.")


def _within_limits(context: EdsContext, entry: EdsEntry) -> Iterator[EdsFinding]:
    low, high = (entry.limit(key, context.node_id) for key in _LIMITS)
    if low is not None and high is not None and low > high:
        expected = f"at least LowLimit ({low})"
        yield at_key(Severity.WARNING, entry.section, "HighLimit", expected, "", "Correct one of the two.")
        return
    default = entry.value(context.node_id)
    formula = read_formula(entry.value_text or "")
    if default is None or formula is None or formula.of_node_id:
        return
    below, above = low is not None and default < low, high is not None and default > high
    if below or above:
        expected = f"at least LowLimit ({low})" if below else f"at most HighLimit ({high})"
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "", "Correct one of the two.")
