"""Rules for what is no object: sections that must be there, FileInfo, DeviceInfo, comments, spelling."""

from __future__ import annotations

import re
from collections.abc import Iterator

from drivers.datasheet.finding import EdsFinding, Severity
from drivers.datasheet.number import read_number
from drivers.datasheet.objects import OBJECT_SECTION, SUB_SECTION
from drivers.datasheet.sheet import BIT_RATES_KBIT_S, NODE_IDS
from drivers.datasheet.text import EdsSection
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section

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
