"""What is to be known of an inverter by reading its objects: nothing here writes one.

A DCF holds what somebody gave one device (CiA 306). The list of commissioned values has what of it the device does not
hold any more, and what the rig file says otherwise; it blames nobody.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from drivers.canopen.can_link import CanLink
from drivers.canopen.pdo_map import PdoLayout
from drivers.canopen.sdo import SdoChannel, SdoNode, object_name
from drivers.capability.carrier import ObjectId
from drivers.capability.plan import DrivePlan
from drivers.errors import ConfigMismatch, ProtocolViolation
from drivers.inverter.check import Difference, configurable_differences, fixed_differences, remarks
from drivers.inverter.drive_settings import drive_settings
from drivers.inverter.pdos import InverterPdos
from drivers.inverter.settings import InverterSettings
from drivers.inverter.stop_proof import Protection, protections, require_protections
from drivers.scaling import IntegerType

COMMANDED: Final = frozenset({0x6040, 0x6060, 0x6071, 0x60B2})  # set by every run, whatever was in them

IDENTITY: Final = ((0x1018, 1), (0x1018, 2))

MOST_PARAMETERS: Final = 0x1400, 0x1C00  # between them are the PDO parameters, which a run sets


@dataclass(frozen=True, slots=True)
class CommissionedValue:
    """One value that is not the same everywhere."""

    what: str  # object and its name in the DCF, or what of ``[DeviceComissioning]`` it is
    dcf: str  # its value in the device configuration file, in words
    device: str  # in the drive
    rig_file: str  # in the rig file

    def __str__(self) -> str:
        parts = (("DCF", self.dcf), ("device", self.device), ("rig file", self.rig_file))
        return f"{self.what}: {', '.join(f'{name} {value}' for name, value in parts if value)}"


def commissioned_values(sdo: SdoChannel, plan: DrivePlan, settings: InverterSettings) -> Iterator[CommissionedValue]:
    """List what is not the same everywhere; nothing without a DCF."""
    commissioning = plan.sheet.commissioning
    if commissioning is None:
        return
    if commissioning.node_id not in (None, settings.node_id):
        yield CommissionedValue("node id", str(commissioning.node_id), "", str(settings.node_id))
    asked = dict(_asked(settings))
    for index, subindex, name in _parameters(plan):
        value = plan.sheet.commissioned(index, subindex)
        found = _found(sdo, index, subindex)
        wanted = asked.get((index, subindex))
        if found != str(value) or wanted not in (None, value):
            shown = "" if wanted is None else str(wanted)
            yield CommissionedValue(f"{name} {object_name(index, subindex)}", str(value), found, shown)


def _asked(settings: InverterSettings) -> Iterator[tuple[tuple[int, int], int]]:
    """List what the rig file has a value for, by object."""
    yield (0x6076, 0), round(settings.rated_torque_nm / settings.rated_torque_unit_nm)
    yield (0x1017, 0), settings.heartbeat_ms
    if settings.vendor_id is not None:
        yield (0x1018, 1), settings.vendor_id
    if settings.product_code is not None:
        yield (0x1018, 2), settings.product_code
    if settings.torque_slope_nm_per_s is not None:
        yield (0x6087, 0), round(1000.0 * settings.torque_slope_nm_per_s / settings.rated_torque_nm)
    for index, code in settings.option_codes.items():
        yield (index, 0), code


def _parameters(plan: DrivePlan) -> Iterator[tuple[int, int, str]]:
    """List what a device keeps: what can be written and is no command, and its identity."""
    first, last = MOST_PARAMETERS
    for index, described in plan.sheet.objects.items():
        if first <= index < last or index in COMMANDED:
            continue
        for subindex, entry in described.entries.items():
            kept = entry.writable or (index, subindex) in IDENTITY
            of_use = entry.kind is not None and entry.kind.code in list(IntegerType) and entry.readable
            if kept and of_use and plan.sheet.commissioned(index, subindex) is not None:
                yield index, subindex, entry.name


def _found(sdo: SdoChannel, index: int, subindex: int) -> str:
    try:
        return str(sdo.upload(index, subindex))
    except (ConfigMismatch, ProtocolViolation):
        return "not to be read"


class InspectedInverter:
    """One inverter on a link, compared with the rig file, its EDS and its DCF."""

    def __init__(self, link: CanLink, settings: InverterSettings) -> None:
        self.settings = settings
        self._link = link
        self._where = settings.where
        self._pdos = InverterPdos(settings)
        self._plan = self._pdos.plan
        self._given = drive_settings(self._plan, settings)
        require_protections(self._plan, settings)
        self._proof: dict[str, str] = {}
        node = SdoNode(settings.node_id, self._pdos.eds.dictionary)
        link.network.add_node(node)
        self._sdo = SdoChannel(node, self._pdos.eds, self._where, settings.sdo_timeout_s)

    def check(self) -> tuple[Difference, ...]:
        """Compare the device with rig file and EDS; reads objects, writes none."""
        return (
            *fixed_differences(self._sdo, self._plan, self.settings),
            *configurable_differences(self._sdo, self._plan, self.settings, self._given),
        )

    def remarks(self) -> tuple[str, ...]:
        """Say what a run will set that the drive does not have yet; reads objects, writes none."""
        return tuple(remarks(self._sdo, self._plan, self.settings, self._given))

    def commissioned(self) -> tuple[CommissionedValue, ...]:
        """List where DCF, device and rig file are not of one mind; empty without a DCF. Reads objects, writes none."""
        return tuple(commissioned_values(self._sdo, self._plan, self.settings))

    def protections(self) -> tuple[Protection, ...]:
        """List what stands between a dead host and torque, with what the last `prove_stop` has seen of it."""
        return tuple(
            replace(each, proof=self._proof.get(each.name, "")) for each in protections(self._plan, self.settings)
        )

    @property
    def layouts(self) -> tuple[PdoLayout, ...]:
        """The PDOs of a run."""
        return tuple(carrier.layout for carrier in self._plan.carriers)

    def read_cob_id(self, layout: PdoLayout) -> int:
        """Read the COB-ID entry of a PDO over SDO, with its flags."""
        return self._sdo.upload(layout.communication_index, 1)

    @property
    def count_rad_s(self) -> float:
        """One count of its speed [rad/s]."""
        return self._pdos.velocity.rad_s_per_count

    def read_speed_rad_s(self) -> float:
        """Read the velocity actual value 0x606C over SDO [rad/s]."""
        return self._pdos.velocity.to_rad_s(self._sdo.upload(0x606C))

    def read_channel(self, channel: ObjectId) -> int:
        """Read the count of a further object over SDO."""
        return self._sdo.upload(*channel)
