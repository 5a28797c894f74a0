"""What configuring gives a drive next to its PDO layouts: which object, which value, and who asks for it.

A dead host must mean zero torque; `drivers.inverter.stop_proof` lists what of this sees to that.

An option code is written where the rig file or a DCF has one: somebody has chosen it. The default of an EDS is nobody's
choice, and a drive that was commissioned otherwise keeps its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from drivers.canopen.emcy import EMCY_COB_ID
from drivers.canopen.sdo import object_name
from drivers.capability.plan import DrivePlan
from drivers.capability.table import EVENT_TIMER, OPTION_CODES, SYNC_COB_ID, Function
from drivers.errors import ConfigMismatch
from drivers.inverter.settings import InverterSettings

__all__ = ["OPTION_CODES", "DriveSetting", "drive_settings"]

SYNC_COB_ID_OBJECT: Final = 0x1005
SYNC_COUNTER_OVERFLOW: Final = 0x1019
EMCY_COB_ID_OBJECT: Final = 0x1014
ABORT_CONNECTION: Final = 0x6007
MAX_TORQUE: Final = 0x6072
MAX_MOTOR_SPEED: Final = 0x6080
TORQUE_SLOPE: Final = 0x6087
PRODUCER_HEARTBEAT: Final = 0x1017

GUARDING: Final = ((0x100C, "guard time"), (0x100D, "life time factor"))

NODES: Final = range(1, 128)

NO_ACTION: Final = 0  # abort connection option code that leaves the torque as it is

THIS_PROGRAM: Final = "this program"
RIG_FILE: Final = "rig file"


@dataclass(frozen=True, slots=True)
class DriveSetting:
    """One object that is written when a drive is configured, and read back."""

    index: int  # of the object
    subindex: int  # of the value in it
    name: str  # its name in CiA 301 or CiA 402
    value: int  # what it is given
    source: str  # who asks for it
    watches_host: bool = False  # whether the drive watches the host by it
    at_most: bool = False  # whether a drive that has less keeps that

    def is_met_by(self, value: int) -> bool:
        """Whether a drive that has this value needs no other."""
        return value <= self.value if self.at_most else value == self.value

    def __str__(self) -> str:
        return f"{self.name} {object_name(self.index, self.subindex)}"


def drive_settings(plan: DrivePlan, settings: InverterSettings) -> tuple[DriveSetting, ...]:
    """List what a drive is given, in the order of writing."""
    _require_action(plan, settings)
    return (
        *_sync(plan),
        *_no_sync_counter(plan),
        *_emcy(plan),
        *_no_node_guarding(plan),
        *_option_codes(plan, settings),
        *_torque_slope(plan, settings),
        *_limits(plan, settings),
        *_deadline(plan, settings),
        *_heartbeats(plan, settings),
    )


def chosen_code(plan: DrivePlan, settings: InverterSettings, index: int) -> tuple[int, str] | None:
    """Give the option code somebody has chosen, and who; None where it is the drive's own."""
    asked, commissioned = settings.option_codes.get(index), plan.sheet.commissioned(index)
    if asked is not None:
        return asked, RIG_FILE
    return None if commissioned is None else (commissioned, plan.sheet.kind)


def _require_action(plan: DrivePlan, settings: InverterSettings) -> None:
    """See that the drive does something without its host, by the values of rig file and data sheet."""
    chosen = chosen_code(plan, settings, ABORT_CONNECTION)
    code, source = chosen or (plan.sheet.value(ABORT_CONNECTION), plan.sheet.kind)
    accepted = "abort_connection" in settings.accepted
    if plan.has(Function.ABORT_CONNECTION) and code == NO_ACTION and not accepted:
        raise ConfigMismatch(
            f"{settings.where}: abort connection option code {object_name(ABORT_CONNECTION)} is to be 0, no action "
            f"({source}): the torque would stay without the host. Expected 1 (fault), 2 (disable voltage) or 3 (quick "
            "stop). Set abort_connection under option_codes of this inverter in the rig file."
        )


def _sync(plan: DrivePlan) -> Iterator[DriveSetting]:
    value = plan.sheet.value(SYNC_COB_ID_OBJECT)
    if plan.abilities[Function.SYNC_ID].writable(plan.sheet):
        yield DriveSetting(SYNC_COB_ID_OBJECT, 0, "COB-ID SYNC", SYNC_COB_ID, THIS_PROGRAM)
    elif value not in (None, SYNC_COB_ID):
        raise ConfigMismatch(
            f"{plan.sheet.kind} {plan.sheet.path}: expected COB-ID SYNC {object_name(SYNC_COB_ID_OBJECT)} that is "
            f"0x{SYNC_COB_ID:08X} or can be written, found 0x{value:08X} for good. The drive can't be used."
        )


def _no_sync_counter(plan: DrivePlan) -> Iterator[DriveSetting]:
    """Switch the SYNC counter off: the host sends none, and a drive that counts takes no other (CiA 301, 7.5.2.22)."""
    entry = plan.sheet.entry(SYNC_COUNTER_OVERFLOW)
    if entry is None or entry.kind is None or not entry.kind.is_integer:  # of no type that can be written: not there
        return
    if entry.settable:
        yield DriveSetting(SYNC_COUNTER_OVERFLOW, 0, "SYNC counter overflow", 0, THIS_PROGRAM)
    elif value := plan.sheet.value(SYNC_COUNTER_OVERFLOW):
        raise ConfigMismatch(
            f"{plan.sheet.kind} {plan.sheet.path}: expected SYNC counter overflow {object_name(SYNC_COUNTER_OVERFLOW)} "
            f"that is 0 or can be written, found {value} for good. The drive can't be used."
        )


def _emcy(plan: DrivePlan) -> Iterator[DriveSetting]:
    """Have EMCY sent where it is heard, if it alone tells the cause of a fault, or goes out as another node's."""
    wanted, described = EMCY_COB_ID + plan.sheet.node_id, plan.sheet.value(EMCY_COB_ID_OBJECT)
    of_another = described is not None and described - EMCY_COB_ID in NODES
    needed = described != wanted and (of_another or not plan.has(Function.ERROR_CODE))
    if needed and plan.abilities[Function.EMCY_ID].writable(plan.sheet):
        yield DriveSetting(EMCY_COB_ID_OBJECT, 0, "COB-ID EMCY", wanted, THIS_PROGRAM)


def emcy_cob_id(plan: DrivePlan) -> int:
    """Give the identifier that the drive's EMCY have in a run: what its sheet holds for good, or what it is given."""
    wanted, described = EMCY_COB_ID + plan.sheet.node_id, plan.sheet.value(EMCY_COB_ID_OBJECT)
    if described is None or plan.abilities[Function.EMCY_ID].writable(plan.sheet):
        return wanted if described is None or list(_emcy(plan)) else described & 0x7FF
    return described & 0x7FF


def _no_node_guarding(plan: DrivePlan) -> Iterator[DriveSetting]:
    entries = [(plan.sheet.entry(index), name) for index, name in GUARDING]
    if all(entry is not None for entry, _ in entries):
        for entry, name in entries:
            if entry is not None and entry.settable:
                yield DriveSetting(entry.index, 0, f"{name} (heartbeat instead)", 0, THIS_PROGRAM)


def _option_codes(plan: DrivePlan, settings: InverterSettings) -> Iterator[DriveSetting]:
    for index, function in OPTION_CODES.items():
        chosen = chosen_code(plan, settings, index)
        if chosen is None:
            continue
        code, source = chosen
        if source == RIG_FILE:
            _require(plan, settings, function, index)
        if plan.abilities[function].writable(plan.sheet):
            yield DriveSetting(index, 0, function.value, code, source)


def _torque_slope(plan: DrivePlan, settings: InverterSettings) -> Iterator[DriveSetting]:
    if settings.torque_slope_nm_per_s is not None:
        _require(plan, settings, Function.TORQUE_SLOPE, TORQUE_SLOPE)
        permille_per_s = round(1000.0 * settings.torque_slope_nm_per_s / settings.rated_torque_nm)
        yield DriveSetting(TORQUE_SLOPE, 0, "torque slope", permille_per_s, RIG_FILE)


def _limits(plan: DrivePlan, settings: InverterSettings) -> Iterator[DriveSetting]:
    """Have the drive itself keep the rig file's limits, whoever commands it."""
    if limits_torque(plan):
        permille = math.ceil(1000.0 * settings.torque_limit_nm / settings.rated_torque_nm - 1e-9)
        yield DriveSetting(MAX_TORQUE, 0, "max torque", permille, RIG_FILE, at_most=True)
    entry = plan.sheet.entry(MAX_MOTOR_SPEED)
    if entry is not None and entry.settable and math.isfinite(settings.speed_limit_rad_s):
        per_minute = math.ceil(settings.speed_limit_rad_s * 30.0 / math.pi)
        yield DriveSetting(MAX_MOTOR_SPEED, 0, "max motor speed", per_minute, RIG_FILE, at_most=True)


def limits_torque(plan: DrivePlan) -> bool:
    """Whether max torque can be written."""
    ability = plan.abilities[Function.MAXIMUM_TORQUE]
    return [part.index for part in ability.parts] == [MAX_TORQUE] and ability.writable(plan.sheet)


def _deadline(plan: DrivePlan, settings: InverterSettings) -> Iterator[DriveSetting]:
    for part in plan.abilities[Function.RPDO_DEADLINE].parts:
        deadline_ms = settings.rpdo_deadline_ms
        yield DriveSetting(part.index, EVENT_TIMER, "RPDO event timer", deadline_ms, RIG_FILE, watches_host=True)


def _heartbeats(plan: DrivePlan, settings: InverterSettings) -> Iterator[DriveSetting]:
    if plan.has(Function.HEARTBEAT_CONSUMER):
        consumer = settings.host_node_id << 16 | settings.host_timeout_ms
        yield DriveSetting(0x1016, 1, "consumer heartbeat time", consumer, RIG_FILE, watches_host=True)
    if plan.abilities[Function.HEARTBEAT_PRODUCER].writable(plan.sheet):
        period_ms = settings.heartbeat_ms
        yield DriveSetting(PRODUCER_HEARTBEAT, 0, "producer heartbeat time", period_ms, RIG_FILE, watches_host=True)
        return
    fixed_ms = plan.sheet.value(PRODUCER_HEARTBEAT)
    if fixed_ms is not None and fixed_ms > settings.heartbeat_ms:
        raise ConfigMismatch(
            f"{settings.where}: heartbeat_ms is {settings.heartbeat_ms}, expected at least {fixed_ms}: the drive's "
            f"heartbeat {object_name(PRODUCER_HEARTBEAT)} can't be set. Write heartbeat_ms = {fixed_ms}."
        )


def _require(plan: DrivePlan, settings: InverterSettings, function: Function, index: int) -> None:
    if not plan.abilities[function].writable(plan.sheet):
        raise ConfigMismatch(
            f"{settings.where}: the rig file gives a value for {function.value} {object_name(index)}, which "
            f"{plan.sheet.kind} {plan.sheet.path} does not have, or not to be written. Take the key out of the rig "
            "file, or use the EDS of the drive's firmware version."
        )
