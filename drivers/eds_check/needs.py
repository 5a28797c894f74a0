"""Rules for what this program wants of a CiA 402 torque drive: the capability table against the file."""

from __future__ import annotations

from collections.abc import Iterator

from drivers.canopen.emcy import EMCY_COB_ID
from drivers.capability.ability import Ability, Shortcoming
from drivers.capability.function import Function, Without
from drivers.capability.speed_unit import described_scale, speed_unit_line, unit_in_words
from drivers.capability.table import SYNC_COB_ID
from drivers.datasheet.finding import EdsFinding, Severity
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section, hexadecimal
from drivers.inverter.drive_settings import (
    ABORT_CONNECTION,
    EMCY_COB_ID_OBJECT,
    GUARDING,
    NO_ACTION,
    SYNC_COB_ID_OBJECT,
)

DEVICE_TYPE = 0x1000
DRIVE_PROFILE = 402

ALWAYS_USED = frozenset(index for index, _ in GUARDING)
"""What counts of every drive, besides what the plan uses."""


def check_needs(context: EdsContext) -> Iterator[EdsFinding]:
    """Check that the drive an EDS describes can be driven."""
    yield from _device_type(context)
    for ability in context.plan.abilities.values():
        yield from _ability(context, ability)
    yield from _velocity_unit(context)
    yield from _abort_connection(context)
    yield from _node_guarding(context)
    yield from _sync(context)
    yield from _emcy(context)


def _device_type(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(DEVICE_TYPE)
    value = None if entry is None else entry.value(context.node_id)
    if entry is not None and value is not None and value & 0xFFFF != DRIVE_PROFILE:
        expected = f"profile {DRIVE_PROFILE} (0x{DRIVE_PROFILE:04X}) in the low half: a drive"
        advice = "Make sure that it is the EDS of a drive."
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, f"{value & 0xFFFF} in", advice)


def _ability(context: EdsContext, ability: Ability) -> Iterator[EdsFinding]:
    if ability.given:
        return
    refused = ability.capability.without is Without.REFUSED
    for shortcoming in ability.shortcomings:
        if not _said_elsewhere(shortcoming) and (refused or shortcoming.entry is not None):
            yield _shortcoming(context, ability, shortcoming, refused)


def _said_elsewhere(lacking: Shortcoming) -> bool:
    """Whether the rules for every object say it: a data type or access that can't be read."""
    entry = lacking.entry
    return entry is not None and ((lacking.key == "DataType" and entry.kind is None) or entry.access is None)


def _shortcoming(context: EdsContext, ability: Ability, lacking: Shortcoming, refused: bool) -> EdsFinding:
    row, part = ability.capability, lacking.part
    severity = Severity.ERROR if refused else Severity.WARNING
    name = f"{row.function.value} {hexadecimal(part.index, part.subindex)}"
    advice = "A drive without it can't be used." if refused else f"Not used: {row.instead}."
    if lacking.entry is not None:
        return at_key(severity, lacking.entry.section, lacking.key, f"{lacking.expected} for {name}", "", advice)
    expected = f"{name}, which this program needs"
    if part.index in context.objects:
        return at_section(severity, context.objects[part.index].section, expected, "none", advice)
    return at_list(context, severity, f"[{part.index:04X}]", expected, "no such object", advice)


def at_list(context: EdsContext, severity: Severity, place: str, expected: str, found: str, advice: str) -> EdsFinding:
    """Say something of an object that is not there, at the list that would name it."""
    listed = context.text.section("OptionalObjects")
    if listed is None:
        return at_file(severity, place, expected, found, advice)
    return EdsFinding(severity, listed.line, place, expected, found, advice)


def _velocity_unit(context: EdsContext) -> Iterator[EdsFinding]:
    ability = context.plan.abilities[Function.SPEED_UNIT]
    if ability.given and described_scale(context.plan, "EDS") is None:
        entry = context.entry(ability.parts[0].index)
        if entry is not None:
            found = "none" if entry.value_text is None else ""
            advice = (
                f"{unit_in_words(context.plan)}: state it in the rig file, such as {speed_unit_line(context.plan)}."
            )
            expected = "a unit of angle per time (CiA 402, CiA 303-2)"
            yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, found, advice)


def _abort_connection(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(ABORT_CONNECTION)
    if entry is not None and entry.value(context.node_id) == NO_ACTION:
        expected = "1 (fault), 2 (disable voltage) or 3 (quick stop): without the host there shall be no torque"
        advice = "Correct it here, or set abort_connection under option_codes in the rig file."
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "no action,", advice)


def _node_guarding(context: EdsContext) -> Iterator[EdsFinding]:
    entries = [entry for entry in (context.entry(index) for index, _ in GUARDING) if entry is not None]
    on = [entry for entry in entries if entry.value(context.node_id)]
    if len(on) == len(GUARDING):
        severity = Severity.WARNING if all(entry.settable for entry in on) else Severity.ERROR
        expected = "0: node guarding off, for the heartbeat takes its place"
        yield at_key(severity, on[0].section, on[0].value_key, expected, "", "A run writes 0 here and in 0x100D.")


def _sync(context: EdsContext) -> Iterator[EdsFinding]:
    """Compare the identifier of SYNC with that of the host's."""
    sync = context.entry(SYNC_COB_ID_OBJECT)
    value = None if sync is None else sync.value(context.node_id)
    if sync is None or value in (None, SYNC_COB_ID):
        return
    set_by_run = context.plan.has(Function.SYNC_ID)
    expected = f"0x{SYNC_COB_ID:08X}: the host sends SYNC with 0x{SYNC_COB_ID:03X}, the drive does not"
    advice = "A run gives it this value." if set_by_run else "A drive that can't be given this value can't be used."
    severity = Severity.WARNING if set_by_run else Severity.ERROR
    yield at_key(severity, sync.section, sync.value_key, expected, "", advice)


def _emcy(context: EdsContext) -> Iterator[EdsFinding]:
    """Compare the identifier of EMCY with the one that is heard."""
    emcy = context.entry(EMCY_COB_ID_OBJECT)
    value = None if emcy is None else emcy.value(context.node_id)
    if emcy is not None and value is not None and value != EMCY_COB_ID + context.node_id:
        advice = "An emergency is not heard at another; faults are still seen in the statusword. Set it at the drive."
        if not context.plan.has(Function.ERROR_CODE) and emcy.settable:
            advice = "A run gives it this value, for the cause of a fault is known by EMCY alone."
        expected = f"$NODEID+0x{EMCY_COB_ID:X}"
        yield at_key(Severity.WARNING, emcy.section, emcy.value_key, expected, "", advice)
