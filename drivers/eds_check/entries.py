"""Rules for the objects in use: what kind each is, its data type and access, and numbers that can be read and fit.

What an object that this program does not use says of itself is no finding: nothing of it is read.
"""

from __future__ import annotations

from collections.abc import Iterator

from drivers.datasheet.file import BIT_RATES_KBIT_S, NODE_IDS, read_octets, read_real
from drivers.datasheet.objects import ACCESS_TYPES, EdsEntry, EdsObject, ObjectType, object_type, sub_sections
from drivers.datasheet.text import EdsFinding, Severity
from drivers.datasheet.types import DATA_TYPES, OCTET_STRING, DataType, octal_matters, read_number
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section

_TYPES = ", ".join(f"0x{kind:X} ({kind.name})" for kind in (ObjectType.VAR, ObjectType.ARRAY, ObjectType.RECORD))
_NUMBERED_VALUES = (ObjectType.VAR, ObjectType.ARRAY, ObjectType.RECORD, ObjectType.DOMAIN)
_TEXT_KEYS = ("parametername", "denotation", "defaultvalue", "parametervalue", "accesstype")


def check_sections(context: EdsContext) -> Iterator[EdsFinding]:
    """Check what the file says of the device as a whole, and of its node."""
    device = context.text.section("DeviceInfo")
    if device is None:
        yield at_file(Severity.ERROR, "[DeviceInfo]", "this section (CiA 306)", "none", "Take the maker's file.")
    elif read_number(device.get("Granularity") or "8") == 0:
        advice = "If the drive's mapping is fixed, configuring it will be refused; ask its maker."
        expected = "8, so that objects can be mapped byte by byte"
        yield at_key(Severity.WARNING, device, "Granularity", expected, "no mapping,", advice)
    node = context.text.commissioning
    for key, allowed, unit in (("NodeID", NODE_IDS, ""), ("Baudrate", BIT_RATES_KBIT_S, " kbit/s")):
        written = None if node is None else node.get(key)
        if node is not None and written and read_number(written) not in allowed:
            expected = f"a number from {allowed[0]} to {allowed[-1]}{unit} (CiA 306)"
            yield at_key(Severity.WARNING, node, key, expected, "", "It is left out; correct it.")


def check_entries(context: EdsContext) -> Iterator[EdsFinding]:
    """Check each object in use, and each of its sub-indices."""
    subs = sub_sections(context.text)
    for index in sorted(context.used & context.objects.keys()):
        described = context.objects[index]
        yield from _object(described, bool(subs.get(index)))
        seen = set()
        for entry in described.entries.values() if described.object_type in _NUMBERED_VALUES else ():
            if entry.section.line not in seen:  # those of CompactSubObj share one section
                seen.add(entry.section.line)
                yield from _entry(entry)
                yield from _numbers(entry)
                if entry.kind is not None:
                    yield from _value(context, entry, entry.kind)


def _object(described: EdsObject, has_subs: bool) -> Iterator[EdsFinding]:
    section, kind = described.section, described.object_type
    if kind is None:
        yield at_key(Severity.ERROR, section, "ObjectType", f"one of {_TYPES}", "", "Take the maker's file.")
    elif kind.has_entries and not described.entries:
        yield at_section(Severity.ERROR, section, "sub-indices, or CompactSubObj", "none", "Describe them.")
    elif has_subs and not kind.has_entries:
        expected = "ObjectType 0x8 (ARRAY) or 0x9 (RECORD), since it has sub-indices"
        yield at_key(Severity.WARNING, section, "ObjectType", expected, "", "Correct it; the sub-indices are not read.")


def _entry(entry: EdsEntry) -> Iterator[EdsFinding]:
    section = entry.section
    if entry.kind is None:
        known = f"0x{min(DATA_TYPES):04X} to 0x{max(DATA_TYPES):04X}"
        found = "none" if section.get("DataType") is None else ""
        advice = "The entry is left out; correct it."
        yield at_key(Severity.ERROR, section, "DataType", f"a data type of CiA 301, {known}", found, advice)
    if entry.access is None and object_type(section, has_entries=False) is not ObjectType.DOMAIN:
        found = "none" if section.get("AccessType") is None else ""
        expected = f"one of {', '.join(ACCESS_TYPES)}"
        yield at_key(Severity.ERROR, section, "AccessType", expected, found, "Take it from the drive's manual.")
    mapping = section.get("PDOMapping")
    if mapping and read_number(mapping) not in (0, 1):
        yield at_key(Severity.ERROR, section, "PDOMapping", "0 or 1", "", "Write 1 if a PDO may carry it.")


def _numbers(entry: EdsEntry) -> Iterator[EdsFinding]:
    """Find numbers whose leading 0 changes them, or makes them none."""
    is_integer = entry.kind is not None and entry.kind.is_integer
    for name, key in entry.section.keys.items():
        if (name not in _TEXT_KEYS or (name == "defaultvalue" and is_integer)) and octal_matters(key.value):
            value = read_number(key.value)
            found = "no octal number" if value is None else f"octal, {value}:"
            expected = "a number without a leading 0, which makes it octal (CiA 306)"
            severity = Severity.ERROR if value is None else Severity.WARNING
            yield at_key(severity, entry.section, key.name, expected, found, "Write it in decimal or as 0x.")


def _value(context: EdsContext, entry: EdsEntry, kind: DataType) -> Iterator[EdsFinding]:
    section, text = entry.section, entry.value_text
    if not kind.is_integer:
        if text is not None and kind.is_real and read_real(text) is None:
            yield at_key(Severity.WARNING, section, entry.value_key, f"a number ({kind.name})", "", "Correct it.")
        elif text is not None and kind.code == OCTET_STRING and read_octets(text) is None:
            expected = "pairs of hexadecimal digits (OCTET_STRING)"
            yield at_key(Severity.WARNING, section, entry.value_key, expected, "", "It is left out; correct it.")
        return
    expected = f"a number of {kind.name}, {kind.low} to {kind.high}"
    if text is not None and entry.value(context.node_id) is None and not octal_matters(text):
        advice = "Write one that fits, or leave it blank."
        yield at_key(Severity.ERROR, section, entry.value_key, expected, "", advice)
    for key in ("LowLimit", "HighLimit"):
        if section.get(key) is not None and entry.limit(key, context.node_id) is None:
            yield at_key(Severity.WARNING, section, key, expected, "", "It is left out; correct it.")
