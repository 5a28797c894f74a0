"""Rules for the three lists of objects, against each other and against the sections that describe objects."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from drivers.datasheet.finding import EdsFinding, Severity
from drivers.datasheet.number import read_number
from drivers.datasheet.objects import sub_sections
from drivers.datasheet.text import EdsSection
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section, hexadecimal

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
