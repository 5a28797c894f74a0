"""Compare an inverter with its rig file and data sheet by reading it: no object is written, no torque commanded.

A *difference* is what neither the data sheet nor a run accounts for. What a run sets by itself, and a drive that holds
its data sheet's value does not have yet, is a *remark*.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from drivers.canopen.emcy import EMCY_COB_ID
from drivers.canopen.pdo_map import PdoLayout, read_layout
from drivers.canopen.sdo import SdoChannel, object_name
from drivers.capability.carrier import Carrier
from drivers.capability.plan import DrivePlan
from drivers.capability.speed_unit import SI_UNIT_VELOCITY, described_scale, scale_of
from drivers.capability.table import OPTION_CODES, Function
from drivers.errors import ConfigMismatch
from drivers.inverter.cia402 import TorqueMode
from drivers.inverter.drive_settings import (
    ABORT_CONNECTION,
    EMCY_COB_ID_OBJECT,
    NO_ACTION,
    DriveSetting,
    chosen_code,
    emcy_cob_id,
    limits_torque,
)
from drivers.inverter.settings import InverterSettings

SERIAL_NUMBER: Final = (0x1018, 4)  # object and entry: the one thing in which two drives of one kind differ


@dataclass(frozen=True, slots=True)
class Difference:
    """One disagreement between a device and what is expected of it."""

    where: str  # device
    what: str  # object and its name
    expected: str  # value that the source gives, in words
    found: str  # value that the device gives, in words
    source: str  # where the expectation comes from

    def __str__(self) -> str:
        return f"{self.where}: {self.what} is {self.found}, expected {self.expected} ({self.source})"


def fixed_differences(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[Difference]:
    """Compare what configuring can't fix: identity, scales, limits, modes."""
    yield from _identity(sdo, plan, settings)
    if plan.has(Function.RATED_TORQUE):
        yield from _rated_torque(sdo, settings)
    yield from _speed_unit(sdo, plan, settings)
    yield from _limit(sdo, plan, settings)
    yield from _mode(sdo, plan, settings)
    yield from _no_action(sdo, plan, settings)


def configurable_differences(
    sdo: SdoChannel,
    plan: DrivePlan,
    settings: InverterSettings,
    given: tuple[DriveSetting, ...],
) -> Iterator[Difference]:
    """Compare what configuring writes and a drive keeps: PDO layouts, SYNC, option codes, torque slope.

    What watches the host is written at every run and is off in a drive that has just been powered: that it
    works is for `drivers.inverter.stop_proof` to show.
    """
    for carrier in plan.carriers:
        found = _layout(sdo, carrier)
        if not _is_given(carrier) and found not in (carrier.layout, carrier.described):
            name = _pdo_name(carrier)
            yield Difference(settings.where, name, f"[{carrier.layout}]", f"[{found}]", plan.sheet.kind)
    for setting, value in _kept(sdo, given):
        if not (setting.is_met_by(value) or setting.at_most or _as_ordered(plan, setting, value)):
            yield Difference(settings.where, str(setting), str(setting.value), str(value), setting.source)


def remarks(
    sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings, given: tuple[DriveSetting, ...]
) -> Iterator[str]:
    """Say what a run will set, and which option codes of the drive's own are not the data sheet's."""
    for carrier in plan.carriers:
        found = _layout(sdo, carrier)
        if found != carrier.layout and (_is_given(carrier) or found == carrier.described):
            yield f"{_pdo_name(carrier)} has [{found}], a run gives it [{carrier.layout}]"
    for setting, value in _kept(sdo, given):
        if not (setting.is_met_by(value) or setting.at_most) and _as_ordered(plan, setting, value):
            yield f"{setting} is {value}, a run gives it {setting.value} ({setting.source})"
    yield from _not_limited(sdo, plan, settings)
    wanted, emcy = EMCY_COB_ID + settings.node_id, emcy_cob_id(plan)
    if emcy != wanted:
        yield (
            f"COB-ID EMCY {object_name(EMCY_COB_ID_OBJECT)} is 0x{emcy:03X} for good, expected 0x{wanted:03X}: its "
            f"emergencies are heard there, and look like those of node {emcy - EMCY_COB_ID}"
        )
    for index, function in OPTION_CODES.items():
        described = plan.sheet.value(index)
        if plan.has(function) and described is not None and chosen_code(plan, settings, index) is None:
            value = sdo.upload(index)
            if value != described and (index, value) != (ABORT_CONNECTION, NO_ACTION):  # that is a difference
                yield (
                    f"{function.value} {object_name(index)} is {value}, the {plan.sheet.kind} has {described}: the "
                    "drive keeps its own. To set it: option_codes in the rig file"
                )


def _is_given(carrier: Carrier) -> bool:
    """Whether a run gives the drive this layout whatever it has: nothing of it is fixed."""
    return carrier.mapped_here or not (carrier.mapping_is_fixed or carrier.fixed)


def _not_limited(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[str]:
    parts = plan.abilities[Function.MAXIMUM_TORQUE].parts
    if limits_torque(plan):
        return
    known = [f"0x{part.index:04X} is {sdo.upload(part.index, part.subindex)} per mille of rated" for part in parts]
    yield (
        f"the drive can't be given the torque limit of {settings.torque_limit_nm:g} Nm as its own "
        f"({' and '.join(known) or 'it has no max torque 0x6072'}): what else is on its bus may command more"
    )


def _as_ordered(plan: DrivePlan, setting: DriveSetting, value: int) -> bool:
    """Whether the drive has what its data sheet says, or that leaves it open."""
    return plan.sheet.value(setting.index, setting.subindex) in (value, None)


def _kept(sdo: SdoChannel, given: tuple[DriveSetting, ...]) -> Iterator[tuple[DriveSetting, int]]:
    """Read what is set and a drive keeps."""
    for setting in given:
        if not setting.watches_host:
            yield setting, sdo.upload(setting.index, setting.subindex)


def _layout(sdo: SdoChannel, carrier: Carrier) -> PdoLayout | str:
    """Read what a PDO has; one that a run maps may be of any kind before."""
    try:
        return read_layout(sdo.upload, carrier.layout.communication_index, carrier.layout.mapping_index)
    except ConfigMismatch:
        if carrier.mapped_here:
            return "what can't be read"
        raise


def _pdo_name(carrier: Carrier) -> str:
    return f"PDO 0x{carrier.layout.communication_index:04X}/0x{carrier.layout.mapping_index:04X}"


def _identity(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[Difference]:
    entries = (
        (1, Function.VENDOR, settings.vendor_id),
        (2, Function.PRODUCT, settings.product_code),
    )
    for subindex, function, from_rig_file in entries:
        expected = plan.sheet.value(0x1018, subindex) if from_rig_file is None else from_rig_file
        if not plan.has(function) or expected is None:
            continue
        found = sdo.upload(0x1018, subindex)
        if found != expected:
            yield Difference(
                settings.where,
                f"{function.value} {object_name(0x1018, subindex)}",
                f"0x{expected:08X}",
                f"0x{found:08X}",
                plan.sheet.kind if from_rig_file is None else "rig file",
            )
    serial_number = None if settings.serial_number is None else sdo.upload(*SERIAL_NUMBER)
    if serial_number != settings.serial_number:
        yield Difference(
            settings.where,
            f"serial number {object_name(*SERIAL_NUMBER)}",
            f"{settings.serial_number}",
            f"{serial_number}: another drive has this node id",
            "rig file",
        )


def _rated_torque(sdo: SdoChannel, settings: InverterSettings) -> Iterator[Difference]:
    unit_nm = settings.rated_torque_unit_nm
    expected, found = round(settings.rated_torque_nm / unit_nm), sdo.upload(0x6076)
    if found != expected:
        yield Difference(
            settings.where,
            "motor rated torque 0x6076",
            f"{expected * unit_nm:g} Nm",
            f"{found * unit_nm:g} Nm",
            "rig file",
        )


def _speed_unit(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[Difference]:
    parts = plan.abilities[Function.SPEED_UNIT].parts
    found = {part.index: sdo.upload(part.index, part.subindex) for part in parts}
    scale = scale_of({**found}, settings.where)
    if settings.speed_unit is None:
        expected = {part.index: plan.sheet.value(part.index, part.subindex) for part in parts}
        for index, value in found.items():
            wanted = expected[index]
            if wanted is not None and value != wanted:
                name = "SI unit velocity 0x60A9" if index == SI_UNIT_VELOCITY else f"unit of speed 0x{index:04X}"
                yield Difference(settings.where, name, f"0x{wanted:08X}", f"0x{value:08X}", plan.sheet.kind)
    elif scale is not None and described_scale(plan, settings.where) is not None:
        stated = settings.speed_unit.scale.rad_s_per_count
        if abs(scale.rad_s_per_count - stated) > 1e-6 * stated:
            names = " and ".join(f"0x{index:04X}" for index in found)
            yield Difference(
                settings.where,
                f"unit of speed {names}",
                f"{settings.speed_unit}, {stated:.6g} rad/s a count",
                f"{scale.rad_s_per_count:.6g} rad/s a count",
                "rig file",
            )


def _limit(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[Difference]:
    parts = plan.abilities[Function.MAXIMUM_TORQUE].parts
    if not parts:
        return
    allowed_nm = min(abs(sdo.upload(part.index)) for part in parts) * settings.rated_torque_nm / 1000.0
    if allowed_nm < settings.torque_limit_nm:
        yield Difference(
            settings.where,
            f"max torque {' and '.join(f'0x{part.index:04X}' for part in parts)}",
            f"at least the torque limit of {settings.torque_limit_nm:g} Nm",
            f"{allowed_nm:g} Nm",
            "rig file",
        )


def _mode(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[Difference]:
    if not plan.has(Function.SUPPORTED_MODES) or "supported_modes" in settings.accepted:
        return  # 0x6061 confirms the mode all the same
    supported = sdo.upload(0x6502)
    if not supported & settings.mode.support_bit:
        known = [mode.title for mode in TorqueMode if supported & mode.support_bit]
        yield Difference(
            settings.where,
            "supported drive modes 0x6502",
            f"mode {settings.mode.title} among them",
            f"0x{supported:08X} with {' and '.join(known) or 'no torque mode'}",
            "rig file",
        )


def _no_action(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[Difference]:
    """Find a drive whose own abort connection option code leaves the torque as it is."""
    accepted = "abort_connection" in settings.accepted
    if not plan.has(Function.ABORT_CONNECTION) or accepted or chosen_code(plan, settings, ABORT_CONNECTION):
        return
    if sdo.upload(ABORT_CONNECTION) == NO_ACTION:
        yield Difference(
            settings.where,
            f"abort connection option code {object_name(ABORT_CONNECTION)}",
            "1 (fault), 2 (disable voltage) or 3 (quick stop): option_codes = { abort_connection = 2 }",
            "0, no action: the torque would stay without the host",
            "this program",
        )
