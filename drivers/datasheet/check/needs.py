"""Rules for what this program needs of a CiA 402 torque drive (docs/supported-protocols.md, column "needed")."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from drivers.canopen.can_link import SYNC_COB_ID
from drivers.canopen.emcy import EMCY_COB_ID
from drivers.datasheet.check.context import SAMPLE_NODE_ID, EdsContext, at_file, at_key, at_section, hexadecimal
from drivers.datasheet.finding import EdsFinding, Severity
from drivers.errors import ConfigMismatch
from drivers.inverter.drive_settings import (
    ABORT_CONNECTION,
    GUARD_TIME,
    LIFE_TIME_FACTOR,
    NO_ACTION,
    OPTION_CODES,
    SYNC_COB_ID_OBJECT,
)
from drivers.scaling import IntegerType, VelocityScale

DEVICE_TYPE = 0x1000
EMCY_COB_ID_OBJECT = 0x1014
SI_UNIT_VELOCITY = 0x60A9
DRIVE_PROFILE = 402


@dataclass(frozen=True, slots=True)
class Need:
    """One value of the object dictionary without which no torque is commanded."""

    index: int
    subindex: int
    name: str
    kind: IntegerType
    written: bool = False


NEEDS = (
    Need(0x1016, 1, "consumer heartbeat time", IntegerType.UNSIGNED32, written=True),
    Need(0x1017, 0, "producer heartbeat time", IntegerType.UNSIGNED16, written=True),
    Need(0x1018, 1, "vendor-ID", IntegerType.UNSIGNED32),
    Need(0x1018, 2, "product code", IntegerType.UNSIGNED32),
    Need(0x603F, 0, "error code", IntegerType.UNSIGNED16),
    Need(0x6040, 0, "controlword", IntegerType.UNSIGNED16, written=True),
    Need(0x6041, 0, "statusword", IntegerType.UNSIGNED16),
    Need(0x6060, 0, "modes of operation", IntegerType.INTEGER8, written=True),
    Need(0x6061, 0, "modes of operation display", IntegerType.INTEGER8),
    Need(0x606C, 0, "velocity actual value", IntegerType.INTEGER32),
    Need(0x6071, 0, "target torque", IntegerType.INTEGER16, written=True),
    Need(0x6072, 0, "max torque", IntegerType.UNSIGNED16),
    Need(0x6076, 0, "motor rated torque", IntegerType.UNSIGNED32),
    Need(0x6077, 0, "torque actual value", IntegerType.INTEGER16),
    Need(SI_UNIT_VELOCITY, 0, "SI unit velocity", IntegerType.UNSIGNED32),
    Need(0x60B2, 0, "torque offset", IntegerType.INTEGER16, written=True),
    Need(0x6502, 0, "supported drive modes", IntegerType.UNSIGNED32),
)
"""Types are those of CiA 301 and CiA 402-2."""

CONFIGURED = (SYNC_COB_ID_OBJECT, *OPTION_CODES)
"""Objects that are read from the EDS or given its values where it has them."""

GUARDING = (GUARD_TIME, LIFE_TIME_FACTOR)
"""Given 0 where the EDS has them; what it says of them may be blank."""

USED = frozenset({need.index for need in NEEDS} | {*CONFIGURED, *GUARDING} | {DEVICE_TYPE, 0x1001, EMCY_COB_ID_OBJECT})
"""What is used of every drive, beside its PDOs."""


def check_needs(context: EdsContext) -> Iterator[EdsFinding]:
    """Check that the drive an EDS describes can be driven."""
    yield from _device_type(context)
    for need in NEEDS:
        yield from _need(context, need)
    yield from _velocity_unit(context)
    yield from _configured(context)
    yield from _node_guarding(context)
    yield from _cob_ids(context)


def _device_type(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(DEVICE_TYPE)
    value = None if entry is None else entry.default(SAMPLE_NODE_ID)
    if entry is not None and value is not None and value & 0xFFFF != DRIVE_PROFILE:
        expected = f"profile {DRIVE_PROFILE} (0x{DRIVE_PROFILE:04X}) in the low half: a drive"
        advice = "Make sure that it is the EDS of a drive."
        yield at_key(Severity.WARNING, entry.section, "DefaultValue", expected, f"{value & 0xFFFF} in", advice)


def _need(context: EdsContext, need: Need) -> Iterator[EdsFinding]:
    entry = context.entry(need.index, need.subindex)
    name = f"{need.name} {hexadecimal(need.index, need.subindex)}"
    if entry is None:
        expected, advice = f"{name}, which this program needs", "A drive without it can't be used."
        if need.index in context.objects:
            yield at_section(Severity.ERROR, context.objects[need.index].section, expected, "none", advice)
        else:
            yield at_file(Severity.ERROR, f"[{need.index:04X}]", expected, "no such object", advice)
        return
    if entry.kind is not None and entry.kind.code not in list(IntegerType):
        expected = f"an integer of 8, 16 or 32 bit for {name}"
        yield at_key(Severity.ERROR, entry.section, "DataType", expected, "", "A drive with another can't be used.")
    elif entry.kind is not None and entry.kind.code != need.kind:
        expected = f"0x{need.kind:04X} ({need.kind.name}) for {name}"
        same_numbers = not need.kind.signed and entry.kind.bits == 8 * need.kind.size_bytes
        severity = Severity.WARNING if same_numbers else Severity.ERROR
        advice = "It is used as the EDS has it." if same_numbers else "Its values would be read as others: correct it."
        yield at_key(severity, entry.section, "DataType", expected, "", advice)
    wrong = "ro" if need.written else "wo"
    if entry.access == wrong or (need.written and entry.access == "const"):
        expected = f"{name} that can be {'written' if need.written else 'read'}"
        yield at_key(Severity.ERROR, entry.section, "AccessType", expected, "", "Look into the drive's manual.")


def _velocity_unit(context: EdsContext) -> Iterator[EdsFinding]:
    entry = context.entry(SI_UNIT_VELOCITY)
    if entry is None:
        return
    value = entry.default(SAMPLE_NODE_ID)
    advice = "Write the unit the drive has, power of ten, angle, time: 0xFDB44700 is 10^-3 rev/min, 0x00B44700 rev/min."
    expected = "a unit of angle per time (CiA 402, CiA 303-2)"
    if value is None:
        yield at_key(Severity.ERROR, entry.section, "DefaultValue", expected, "none", advice)
        return
    try:
        VelocityScale.from_object(value, "EDS")
    except ConfigMismatch:
        yield at_key(Severity.ERROR, entry.section, "DefaultValue", expected, "", advice)


def _configured(context: EdsContext) -> Iterator[EdsFinding]:
    for index in CONFIGURED:
        entry = context.entry(index)
        if entry is None:
            continue
        if entry.default(SAMPLE_NODE_ID) is None:
            expected = f"a value for {hexadecimal(index)}, which the drive is given"
            found = "none" if entry.default_text is None else ""
            advice = "Write the value it shall have."
            yield at_key(Severity.ERROR, entry.section, "DefaultValue", expected, found, advice)
        if entry.access in ("ro", "const"):
            expected = f"{hexadecimal(index)} that can be written, for the drive is given its value"
            advice = "If the drive's is fixed, take the object out of your copy of the EDS."
            yield at_key(Severity.ERROR, entry.section, "AccessType", expected, "", advice)
    abort = context.entry(ABORT_CONNECTION)
    if abort is not None and abort.default(SAMPLE_NODE_ID) == NO_ACTION:
        expected = "1 (fault), 2 (disable voltage) or 3 (quick stop): without the host there shall be no torque"
        advice = "Correct it here, or set abort_connection under option_codes in the rig file."
        yield at_key(Severity.WARNING, abort.section, "DefaultValue", expected, "no action,", advice)


def _node_guarding(context: EdsContext) -> Iterator[EdsFinding]:
    pair = [context.entry(index) for index in GUARDING]
    entries = [entry for entry in pair if entry is not None and entry.default(SAMPLE_NODE_ID)]
    if len(entries) == len(pair):
        expected = "0: node guarding off, for the heartbeat takes its place"
        yield at_key(Severity.ERROR, entries[0].section, "DefaultValue", expected, "", "Write 0 here and in 0x100D.")


def _cob_ids(context: EdsContext) -> Iterator[EdsFinding]:
    """Compare the identifiers of SYNC and EMCY with those the host sends and hears."""
    sync = context.entry(SYNC_COB_ID_OBJECT)
    value = None if sync is None else sync.default(SAMPLE_NODE_ID)
    if sync is not None and value is not None and value != SYNC_COB_ID:
        expected = f"0x{SYNC_COB_ID:08X}: the host sends SYNC with 0x{SYNC_COB_ID:03X}, the drive does not"
        advice = "Correct it in your copy of the EDS; the drive is given this value."
        yield at_key(Severity.ERROR, sync.section, "DefaultValue", expected, "", advice)
    emcy = context.entry(EMCY_COB_ID_OBJECT)
    value = None if emcy is None else emcy.default(SAMPLE_NODE_ID)
    if emcy is not None and value is not None and value != EMCY_COB_ID + SAMPLE_NODE_ID:
        advice = "An emergency is not heard at another; faults are still seen in the statusword. Set it at the drive."
        expected = f"$NODEID+0x{EMCY_COB_ID:X}"
        yield at_key(Severity.WARNING, emcy.section, "DefaultValue", expected, "", advice)
