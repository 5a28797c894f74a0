"""Compare an inverter with its rig file and EDS by reading it: no object is written, no torque commanded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from drivers.canopen.pdo_map import PdoLayout, read_layout
from drivers.canopen.sdo import SdoChannel, object_name
from drivers.datasheet.file import EdsFile
from drivers.inverter.cia402 import TorqueMode
from drivers.inverter.drive_settings import DriveSetting
from drivers.inverter.settings import InverterSettings


@dataclass(frozen=True, slots=True)
class Difference:
    """One disagreement between a device and what is expected of it.

    Attributes
    ----------
    where
        Device.
    what
        Object and its name.
    expected, found
        Both values in words.
    source
        Where the expectation comes from: rig file or EDS.
    """

    where: str
    what: str
    expected: str
    found: str
    source: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what} is {self.found}, expected {self.expected} ({self.source})"


def fixed_differences(sdo: SdoChannel, eds: EdsFile, settings: InverterSettings) -> Iterator[Difference]:
    """Compare what configuring can't mend: identity, scales, limits, modes."""
    yield from _identity(sdo, eds, settings)
    rated_mnm, found_mnm = round(settings.rated_torque_nm * 1000), sdo.upload(0x6076)
    if found_mnm != rated_mnm:
        yield Difference(
            settings.where,
            "motor rated torque 0x6076",
            f"{rated_mnm / 1000:g} Nm",
            f"{found_mnm / 1000:g} Nm",
            "rig file",
        )
    unit, found_unit = eds.default(0x60A9), sdo.upload(0x60A9)
    if found_unit != unit:
        yield Difference(settings.where, "SI unit velocity 0x60A9", f"0x{unit:08X}", f"0x{found_unit:08X}", "EDS")
    yield from _limit(sdo, settings)
    yield from _mode(sdo, settings)


def configurable_differences(
    sdo: SdoChannel,
    settings: InverterSettings,
    layouts: tuple[PdoLayout, ...],
    given: tuple[DriveSetting, ...],
) -> Iterator[Difference]:
    """Compare what configuring writes and a drive keeps: PDO layouts, SYNC, option codes, torque slope.

    What watches the host is written at every run and is off in a drive that has just been powered: that it
    works is for `drivers.inverter.stop_proof` to show.
    """
    for expected in layouts:
        found = read_layout(sdo.upload, expected.communication_index, expected.mapping_index)
        if found != expected:
            name = f"PDO 0x{expected.communication_index:04X}/0x{expected.mapping_index:04X}"
            yield Difference(settings.where, name, f"[{expected}]", f"[{found}]", "EDS")
    for setting in given:
        if not setting.watches_host:
            found_value = sdo.upload(setting.index, setting.subindex)
            if found_value != setting.value:
                yield Difference(settings.where, str(setting), str(setting.value), str(found_value), setting.source)


def _identity(sdo: SdoChannel, eds: EdsFile, settings: InverterSettings) -> Iterator[Difference]:
    entries = ((1, "vendor-ID", settings.vendor_id), (2, "product code", settings.product_code))
    for subindex, name, from_rig_file in entries:
        expected = eds.default(0x1018, subindex) if from_rig_file is None else from_rig_file
        found = sdo.upload(0x1018, subindex)
        if found != expected:
            yield Difference(
                settings.where,
                f"{name} {object_name(0x1018, subindex)}",
                f"0x{expected:08X}",
                f"0x{found:08X}",
                "EDS" if from_rig_file is None else "rig file",
            )


def _limit(sdo: SdoChannel, settings: InverterSettings) -> Iterator[Difference]:
    allowed_nm = sdo.upload(0x6072) * settings.rated_torque_nm / 1000.0
    if allowed_nm < settings.torque_limit_nm:
        yield Difference(
            settings.where,
            "max torque 0x6072",
            f"at least the torque limit of {settings.torque_limit_nm:g} Nm",
            f"{allowed_nm:g} Nm",
            "rig file",
        )


def _mode(sdo: SdoChannel, settings: InverterSettings) -> Iterator[Difference]:
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
