"""Rules for sections that describe no object: those that must be there, FileInfo, DeviceInfo, comments, spelling.

The three lists of objects are held against each other and against the sections that describe objects.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from drivers.datasheet.file import BIT_RATES_KBIT_S, NODE_IDS
from drivers.datasheet.objects import OBJECT_SECTION, SUB_SECTION, sub_sections
from drivers.datasheet.text import EdsFinding, EdsSection, Severity
from drivers.datasheet.types import read_number
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section, hexadecimal

BAUD_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
"""kbit/s, each with a flag ``BaudRate_10`` in DeviceInfo."""

MAX_GRANULARITY = 64
"""Bits; 0 says that no PDO mapping can be changed."""

_MANDATORY = {
    "FileInfo": Severity.WARNING,
    "DeviceInfo": Severity.ERROR,
    "MandatoryObjects": Severity.WARNING,
    "OptionalObjects": Severity.WARNING,
    "ManufacturerObjects": Severity.WARNING,
}
"""The drivers take a file without DeviceInfo for another kind of file; the rest only lists what is described."""

_SPELLINGS = (
    *_MANDATORY,
    *("Comments", "DummyUsage", "StandardDataTypes", "DeviceComissioning", "DeviceCommissioning"),
    *("SupportedModules", "DynamicChannels", "Tools"),
)
_OTHER_SECTIONS = re.compile(
    r"[0-9a-f]{4}(name|value|objectlinks|denotation)|tool\d+|m\d+\w*|[0-9a-f]{2}(sub[0-9a-f]+)?", re.IGNORECASE
)
_CANONICAL_OBJECT = re.compile(r"[0-9A-Fa-f]{4}(sub[0-9A-Fa-f]{1,2}|Name|Value|ObjectLinks|Denotation)?")

_FILE_KEYS = ("FileName", "FileVersion", "FileRevision", "EDSVersion", "Description", "CreatedBy")
_DEVICE_TEXTS = ("VendorName", "ProductName")
_DEVICE_NUMBERS = {
    "VendorNumber": 0xFFFFFFFF,
    "ProductNumber": 0xFFFFFFFF,
    "RevisionNumber": 0xFFFFFFFF,
    "SimpleBootUpMaster": 1,
    "SimpleBootUpSlave": 1,
    "NrOfRXPDO": 0x200,
    "NrOfTXPDO": 0x200,
    "LSS_Supported": 1,
}
"""Greatest value of each."""

_IDENTITY = {"VendorNumber": 1, "ProductNumber": 2}
"""Sub-index of 0x1018 that holds the same."""

_DATE = re.compile(r"(0?[1-9]|1[0-2])-(0?[1-9]|[12]\d|3[01])-\d{4}")
_TIME = re.compile(r"(0?\d|1[0-2]):[0-5]\d\s?(AM|PM)", re.IGNORECASE)


def check_sections(context: EdsContext) -> Iterator[EdsFinding]:
    """Check everything that is no object."""
    for name, severity in _MANDATORY.items():
        if context.text.section(name) is None:
            yield at_file(severity, f"[{name}]", "this section (CiA 306)", "none", "Add it; take the maker's file.")
    for section in context.text.sections.values():
        yield from _known(section)
    yield from _spelling(context)
    yield from _file_info(context.text.section("FileInfo"))
    yield from _device_info(context.text.section("DeviceInfo"))
    yield from _identity(context)
    yield from _comments(context.text.section("Comments"))
    yield from _commissioning(context.text.commissioning)


def _known(section: EdsSection) -> Iterator[EdsFinding]:
    name = section.name.lower()
    if not (
        name in (each.lower() for each in _SPELLINGS)
        or OBJECT_SECTION.fullmatch(name)
        or SUB_SECTION.fullmatch(name)
        or _OTHER_SECTIONS.fullmatch(name)
    ):
        expected = "a section of CiA 306"
        yield at_section(Severity.NOTE, section, expected, "another", "It is not read; look for a slip in its name.")


def _spelling(context: EdsContext) -> Iterator[EdsFinding]:
    """Say once that names have other capitals: other tools, canopen's reader among them, lose such sections."""
    odd = [section for section in context.text.sections.values() if not _as_usual(section.name)]
    if odd:
        many = "" if len(odd) == 1 else f", and {len(odd) - 1} more"
        expected = "capitals as CiA 306 has them, such as [DeviceInfo] and [1018sub1]"
        yield at_section(Severity.NOTE, odd[0], expected, f"this one{many}", "Read all the same; other tools may not.")


def _as_usual(name: str) -> bool:
    known = {each.lower(): each for each in _SPELLINGS}
    if name.lower() in known:
        return known[name.lower()] == name
    is_object = OBJECT_SECTION.match(name.lower())
    return not is_object or bool(_CANONICAL_OBJECT.fullmatch(name))


def _file_info(section: EdsSection | None) -> Iterator[EdsFinding]:
    if section is None:
        return
    for key in _FILE_KEYS:
        if section.get(key) is None:
            yield at_key(Severity.NOTE, section, key, "this key (CiA 306)", "none", "Nothing of it is used here.")
    for key, form, like in (
        ("CreationDate", _DATE, "mm-dd-yyyy"),
        ("ModificationDate", _DATE, "mm-dd-yyyy"),
        ("CreationTime", _TIME, "hh:mm with AM or PM"),
        ("ModificationTime", _TIME, "hh:mm with AM or PM"),
    ):
        written = section.get(key)
        if written is not None and not form.fullmatch(written):
            yield at_key(Severity.NOTE, section, key, like, "", "Nothing of it is used here.")


def _device_info(section: EdsSection | None) -> Iterator[EdsFinding]:
    if section is None:
        return
    for key in _DEVICE_TEXTS:
        if section.get(key) is None:
            yield at_key(Severity.NOTE, section, key, "this key (CiA 306)", "none", "Nothing of it is used here.")
    for key, most in _DEVICE_NUMBERS.items():
        yield from _number(section, key, most)
    yield from _baud_rates(section)
    yield from _number(section, "Granularity", MAX_GRANULARITY)
    if read_number(section.get("Granularity") or "8") == 0:
        advice = "If the drive's mapping is fixed, configuring it will be refused; ask its maker."
        expected = "8, so that objects can be mapped byte by byte"
        yield at_key(Severity.WARNING, section, "Granularity", expected, "no mapping,", advice)


def _commissioning(section: EdsSection | None) -> Iterator[EdsFinding]:
    """Check what a DCF says of its node; what can't be read says nothing."""
    for key, allowed, unit in (("NodeID", NODE_IDS, ""), ("Baudrate", BIT_RATES_KBIT_S, " kbit/s")):
        written = None if section is None else section.get(key)
        if section is not None and written and read_number(written) not in allowed:
            expected = f"a number from {allowed[0]} to {allowed[-1]}{unit} (CiA 306)"
            yield at_key(Severity.WARNING, section, key, expected, "", "It is left out; correct it.")


def _number(section: EdsSection, key: str, most: int) -> Iterator[EdsFinding]:
    written = section.get(key)
    if written is None:
        yield at_key(Severity.WARNING, section, key, "this key (CiA 306)", "none", "Add it.")
        return
    number = read_number(written)
    if number is None or not 0 <= number <= most:
        limit = f"0x{most:X}" if most > MAX_GRANULARITY else str(most)
        yield at_key(Severity.WARNING, section, key, f"a number from 0 to {limit}", "", "Write it as 10 or 0x0A.")


def _baud_rates(section: EdsSection) -> Iterator[EdsFinding]:
    flags = {rate: section.get(f"BaudRate_{rate}") for rate in BAUD_RATES}
    for rate, written in flags.items():
        if written is None:
            yield at_key(
                Severity.WARNING,
                section,
                f"BaudRate_{rate}",
                "0 or 1 (CiA 306)",
                "none",
                "Write 1 if the drive has it.",
            )
        elif read_number(written) not in (0, 1):
            yield at_key(
                Severity.WARNING, section, f"BaudRate_{rate}", "0 or 1", "", "Write 1 if the drive has it, otherwise 0."
            )
    if not any(read_number(written or "0") for written in flags.values()):
        advice = "Write 1 for each that the drive has."
        yield at_section(Severity.WARNING, section, "at least one BaudRate_ key of 1", "none", advice)


def _identity(context: EdsContext) -> Iterator[EdsFinding]:
    """Compare DeviceInfo with the identity object; the object is what counts."""
    section = context.text.section("DeviceInfo")
    for key, subindex in _IDENTITY.items():
        entry = context.entry(0x1018, subindex)
        given = None if section is None else read_number(section.get(key) or "")
        default = None if entry is None else entry.value(context.node_id)
        if section is not None and entry is not None and None not in (given, default) and given != default:
            expected = f"0x{default:08X}, the default of 0x1018:{subindex:02X} (line {entry.section.line})"
            advice = "Correct one; the rig file says which drive it is."
            yield at_key(Severity.WARNING, section, key, expected, "", advice)


def _comments(section: EdsSection | None) -> Iterator[EdsFinding]:
    if section is None:
        return
    lines = [key for key in section.keys if re.fullmatch(r"line\d+", key)]
    written = read_number(section.get("Lines") or "")
    if written != len(lines):
        yield at_key(
            Severity.NOTE, section, "Lines", f"{len(lines)}, the comment lines there are", "", "Correct the count."
        )


MANDATORY = (0x1000, 0x1001, 0x1018)
"""Objects every CANopen device has (CiA 301): device type, error register, identity."""

MANUFACTURER = range(0x2000, 0x6000)
"""Indices that belong to the maker."""

_LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
_POSITION = re.compile(r"\d{1,9}")


@dataclass(frozen=True, slots=True)
class _Listed:
    section: EdsSection
    key: str
    index: int


def check_lists(context: EdsContext) -> Iterator[EdsFinding]:
    """Check the lists; what is described counts for the drivers, listed or not."""
    listed: dict[int, _Listed] = {}
    for name in _LISTS:
        section = context.text.section(name)
        if section is not None:
            yield from _count(section)
            for each in _entries(section):
                yield from _one(context, each, listed)
                listed.setdefault(each.index, each)
            yield from _unreadable(section)
    for index in MANDATORY:
        if index not in context.objects:
            name = f"[{index:04X}]"
            advice = "Take the maker's file."
            yield at_file(Severity.WARNING, name, "this object, mandatory by CiA 301", "none", advice)
    yield from _not_listed(context, listed)
    yield from _orphans(context)


def _count(section: EdsSection) -> Iterator[EdsFinding]:
    there = {int(key) for key in section.keys if _POSITION.fullmatch(key)}
    written = read_number(section.get("SupportedObjects") or "")
    if written != len(there):
        expected = f"{len(there)}, the objects in the list"
        advice = "Correct the count; all that is in the list is read."
        found = "none" if section.get("SupportedObjects") is None else ""
        yield at_key(Severity.WARNING, section, "SupportedObjects", expected, found, advice)
    gap = next((n for n in range(1, len(there) + 1) if n not in there), None)
    if gap is not None:
        expected = f"the keys 1 to {len(there)} without a gap"
        yield at_section(Severity.WARNING, section, expected, f"none with {gap}", "Number them again.")


def _entries(section: EdsSection) -> Iterator[_Listed]:
    for name, key in section.keys.items():
        index = read_number(key.value)
        if _POSITION.fullmatch(name) and index is not None:
            yield _Listed(section, name, index)


def _unreadable(section: EdsSection) -> Iterator[EdsFinding]:
    for name, key in section.keys.items():
        if _POSITION.fullmatch(name) and read_number(key.value) is None:
            yield at_key(Severity.WARNING, section, name, "an index such as 0x6071", "", "Write it so.")


def _one(context: EdsContext, each: _Listed, before: dict[int, _Listed]) -> Iterator[EdsFinding]:
    name = hexadecimal(each.index)
    if each.index in before:
        first = before[each.index]
        found = f"it in line {first.section.line_of(first.key)} too,"
        yield at_key(Severity.WARNING, each.section, each.key, f"{name} listed once", found, "Take one out.")
        return
    proper = _proper_list(each.index)
    if proper.lower() != each.section.name.lower():
        expected = f"{name} under [{proper}]"
        yield at_key(
            Severity.WARNING, each.section, each.key, expected, "it here,", "Move it; it is read all the same."
        )
    if each.index not in context.objects:
        expected = f"a section [{each.index:04X}] for the object listed"
        advice = "Describe it, or take it out of the list."
        yield at_key(Severity.WARNING, each.section, each.key, expected, "none for", advice)


def _proper_list(index: int) -> str:
    if index in MANDATORY:
        return "MandatoryObjects"
    return "ManufacturerObjects" if index in MANUFACTURER else "OptionalObjects"


def _not_listed(context: EdsContext, listed: dict[int, _Listed]) -> Iterator[EdsFinding]:
    for index, described in context.objects.items():
        if index not in listed and index >= MANDATORY[0]:
            expected = f"{hexadecimal(index)} in [{_proper_list(index)}]"
            advice = "List it; it is read all the same."
            yield at_section(Severity.WARNING, described.section, expected, "it in no list", advice)


def _orphans(context: EdsContext) -> Iterator[EdsFinding]:
    for index, subs in sub_sections(context.text).items():
        if index not in context.objects:
            for section in subs.values():
                expected = f"a section [{index:04X}] of the object it belongs to"
                advice = "Describe the object; this is not read."
                yield at_section(context.severity(index), section, expected, "none", advice)
