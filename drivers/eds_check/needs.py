"""Rules for what this program wants of a CiA 402 torque drive: the capability table against the file.

With them what the drive says of its modes of operation and a SYNC counter, and what the rig file has to say because the
data sheet does not: lines ready to paste, with the reasons.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from drivers.canopen.emcy import EMCY_COB_ID
from drivers.canopen.sdo import object_name
from drivers.capability.plan import Ability, DrivePlan, Shortcoming
from drivers.capability.speed_unit import described_scale, speed_unit_line, unit_in_words
from drivers.capability.table import SYNC_COB_ID, Function, Without
from drivers.datasheet.text import EdsFinding, Severity
from drivers.eds_check.context import EdsContext, at_file, at_key, at_section
from drivers.inverter.cia402 import TorqueMode
from drivers.inverter.drive_settings import (
    ABORT_CONNECTION,
    EMCY_COB_ID_OBJECT,
    GUARDING,
    NO_ACTION,
    NODES,
    PRODUCER_HEARTBEAT,
    SYNC_COB_ID_OBJECT,
    SYNC_COUNTER_OVERFLOW,
)
from drivers.inverter.settings import InverterSettings, acceptance_line
from drivers.inverter.stop_proof import protections

DEVICE_TYPE = 0x1000
DRIVE_PROFILE = 402

ALWAYS_USED = frozenset(index for index, _ in GUARDING)
"""What counts of every drive, besides what the plan uses."""

SUPPORTED_MODES = 0x6502

_TORQUE_MODES = TorqueMode.PROFILE_TORQUE.support_bit | TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE.support_bit

USUAL_HEARTBEAT_MS = 100


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
    name = f"{row.function.value} {object_name(part.index, part.subindex)}"
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


def check_modes(context: EdsContext) -> Iterator[EdsFinding]:
    """Check that the drive has a torque mode, as far as the file says, and takes a SYNC without a counter."""
    yield from _torque_mode(context)
    yield from _sync_counter(context)


def _torque_mode(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(SUPPORTED_MODES)
    if entry is None:
        return
    values = {entry.value(node_id) for node_id in NODES}  # one, unless by some mistake it follows from the node id
    if any(value and not value & _TORQUE_MODES for value in values):  # blank and 0 say nothing: the drive is asked
        expected = f"a torque mode among the supported ones: {' or '.join(mode.title for mode in TorqueMode)}"
        advice = "Look into the drive's manual; a drive without one can't be used."
        yield at_key(Severity.WARNING, entry.section, entry.value_key, expected, "none in", advice)


def _sync_counter(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(SYNC_COUNTER_OVERFLOW)
    if entry is None or not entry.value(context.node_id):
        return
    fixed = not entry.settable
    expected = "0: a SYNC without a counter, as the host sends it"
    advice = "The drive would take no SYNC." if fixed else "It is set to 0 when the drive is configured."
    yield at_key(Severity.ERROR if fixed else Severity.WARNING, entry.section, entry.value_key, expected, "", advice)


@dataclass(frozen=True, slots=True)
class RigLine:
    """One line under ``[inverters.m1]`` or ``[inverters.m2]``."""

    text: str  # the line
    reason: str  # why it has to be there

    @property
    def key(self) -> str:
        """The key it gives a value to."""
        return self.text.partition(" = ")[0]


def rig_lines(plan: DrivePlan) -> tuple[RigLine, ...]:
    """List the lines a drive needs; none if its data sheet says it all."""
    return tuple(_lines(plan))


def usual_mode(plan: DrivePlan) -> TorqueMode:
    """Choose the mode of operation: cyclic synchronous torque, unless the drive has profile torque alone."""
    supported = _supported_modes(plan)
    cyclic, profile = TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE, TorqueMode.PROFILE_TORQUE
    only_profile = supported is not None and not supported & cyclic.support_bit and supported & profile.support_bit
    return profile if only_profile else cyclic


def _supported_modes(plan: DrivePlan) -> int | None:
    """Read supported drive modes from the data sheet; 0 is a place left free."""
    value = plan.sheet.value(0x6502) if plan.has(Function.SUPPORTED_MODES) else None
    return value or None


def _lines(plan: DrivePlan) -> Iterator[RigLine]:
    mode = usual_mode(plan)
    if mode is not TorqueMode.CYCLIC_SYNCHRONOUS_TORQUE:
        yield RigLine(f'mode = "{mode.name.lower()}"', "0x6502 has no other torque mode")
    if described_scale(plan, "data sheet") is None:
        yield RigLine(speed_unit_line(plan), f"what a count of 0x606C is: {unit_in_words(plan)}; see the manual")
    fixed_ms = plan.sheet.value(PRODUCER_HEARTBEAT)
    writable = plan.abilities[Function.HEARTBEAT_PRODUCER].writable(plan.sheet)
    if not writable and fixed_ms is not None and fixed_ms > USUAL_HEARTBEAT_MS:
        yield RigLine(f"heartbeat_ms = {fixed_ms}", "0x1017 can't be written")
    no_action = plan.has(Function.ABORT_CONNECTION) and plan.sheet.value(ABORT_CONNECTION) == NO_ACTION
    codes = {}
    if no_action and plan.abilities[Function.ABORT_CONNECTION].writable(plan.sheet):
        codes = {ABORT_CONNECTION: 2}
        yield RigLine("option_codes.abort_connection = 2", "0x6007 is 0, no action: 2 disables the voltage")
    supported = _supported_modes(plan)
    if supported is not None and not any(supported & each.support_bit for each in TorqueMode):
        reason = f"0x6502 is 0x{supported:08X}, without a torque mode: the mode display 0x6061 alone confirms it"
        yield RigLine(acceptance_line("supported_modes"), reason)
    settings = InverterSettings("m1", plan.sheet.node_id, 1.0, 1.0, option_codes=codes)
    for each in protections(plan, settings):
        if not each.in_order:
            yield RigLine(acceptance_line(each.name), f"not in the data sheet: {each.against}")
