"""The PDOs of an inverter, found by the objects they carry, and set up as a run wants them.

A run on the bus and the replay of a bus trace read the same frames by these. Set-up is over SDO and read back; only
what differs is written: a drive that has the mapping already, for good or from the run before, keeps it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from drivers.canopen.pdo_map import (
    COB_ID_INVALID,
    COB_ID_NO_RTR,
    PdoCodec,
    PdoLayout,
    configuration_writes,
    read_layout,
)
from drivers.canopen.sdo import SdoChannel
from drivers.capability.carrier import RPDO, TPDO, Carrier
from drivers.capability.carrier_search import MODES_OF_OPERATION
from drivers.capability.plan import DrivePlan, plan_drive
from drivers.capability.speed_unit import speed_scale
from drivers.datasheet.file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.inverter.cia402 import Command
from drivers.inverter.feedback import ChannelReceiver, FeedbackReceiver
from drivers.inverter.settings import InverterSettings
from drivers.scaling import TorqueScale, VelocityScale
from drivers.torque_guard import GuardedTorque

CONTROLWORD, TARGET_TORQUE, TORQUE_OFFSET = 0x6040, 0x6071, 0x60B2


def codecs(eds: EdsFile, carriers: Iterable[Carrier], where: str) -> tuple[PdoCodec, ...]:
    """Build packers and unpackers of PDOs."""
    return tuple(eds.codec(carrier.layout, where) for carrier in carriers)


class InverterPdos:
    """Frames of one inverter, down and up."""

    def __init__(self, settings: InverterSettings) -> None:
        where = settings.where
        self.eds = EdsFile(settings.eds_path, settings.node_id)
        self.plan: DrivePlan = plan_drive(self.eds.sheet, settings.channels)
        self._rpdos = codecs(self.eds, self.plan.pdos(RPDO), where)
        self._tpdos = codecs(self.eds, self.plan.pdos(TPDO), where)
        self._channel_tpdos = codecs(self.eds, self.plan.channel_carriers(), where)
        self.rpdos = tuple(codec.layout.cob_id for codec in self._rpdos)
        self.velocity: VelocityScale = speed_scale(self.plan, settings.speed_unit, where)
        self._torque = TorqueScale(settings.rated_torque_nm)
        self._where = where
        self._mode = settings.mode.value

    @property
    def has_offset(self) -> bool:
        """Whether the PRBS goes into an object of its own."""
        return any(TORQUE_OFFSET in codec.indices for codec in self._rpdos)

    def receiver(self) -> FeedbackReceiver:
        """Build what reads the TPDOs' frames in SI units."""
        return FeedbackReceiver(self._tpdos, self._torque, self.velocity)

    def channel_receiver(self) -> ChannelReceiver:
        """Build what reads the further objects in the TPDOs' frames."""
        return ChannelReceiver(self._channel_tpdos, self.plan.channels)

    def counts(self, torque: GuardedTorque) -> TorqueCounts:
        """Turn a command into counts; base and PRBS are summed where the drive has one object for both."""
        if self.has_offset:
            return TorqueCounts(
                self._torque.to_raw(torque.base_nm, self._where), self._torque.to_raw(torque.prbs_nm, self._where)
            )
        return TorqueCounts(self._torque.to_raw(torque.base_nm + torque.prbs_nm, self._where), 0)

    def frames(self, command: Command, counts: TorqueCounts) -> list[tuple[int, bytes]]:
        """Build the RPDOs' frames, each with its identifier; a filler is 0."""
        values = {
            CONTROLWORD: command.value,
            TARGET_TORQUE: counts.target,
            TORQUE_OFFSET: counts.offset,
            MODES_OF_OPERATION: self._mode,
        }
        return [
            (codec.layout.cob_id, codec.pack(tuple([values.get(index, 0) for index in codec.indices])))
            for codec in self._rpdos
        ]

    def unpack(self, cob_id: int, data: bytes) -> TorqueOnBus:
        """Read the torque of an RPDO's frame."""
        codec = self._rpdos[self.rpdos.index(cob_id)]
        values = dict(zip(codec.indices, codec.unpack(data), strict=True))
        return TorqueOnBus(*(self._nm(values.get(index)) for index in (TARGET_TORQUE, TORQUE_OFFSET)))

    def _nm(self, counts: int | None) -> float | None:
        return None if counts is None else self._torque.to_nm(counts)


@dataclass(frozen=True, slots=True)
class TorqueCounts:
    """Target torque and torque offset in per mille of the rated torque."""

    target: int = 0  # object 0x6071
    offset: int = 0  # object 0x60B2

    @property
    def total(self) -> int:
        """Target plus offset [per mille of the rated torque]."""
        return self.target + self.offset


@dataclass(frozen=True, slots=True)
class TorqueOnBus:
    """Target torque and torque offset of a frame [Nm]; None what it does not carry."""

    target_nm: float | None  # object 0x6071 [Nm]
    offset_nm: float | None  # object 0x60B2 [Nm]


def set_up_pdos(sdo: SdoChannel, plan: DrivePlan, where: str) -> None:
    """Switch off the PDOs that would disturb, and give those of the plan their layouts."""
    for index in plan.pdos_to_disable:
        _switch_off(sdo, index)
    for carrier in plan.carriers:
        _write(sdo, carrier)
        _require_layout(sdo, carrier.layout, where)


def _switch_off(sdo: SdoChannel, communication_index: int) -> None:
    present = sdo.upload(communication_index, 1)
    if not present & COB_ID_INVALID:
        sdo.download_confirmed(communication_index, 1, present | COB_ID_INVALID, ignored=COB_ID_NO_RTR)


def _write(sdo: SdoChannel, carrier: Carrier) -> None:
    """Write all but what the drive holds for good, and a mapping that is right."""
    layout = carrier.layout
    maps_it = _maps(sdo, layout)
    for index, subindex, value in configuration_writes(layout, sdo.upload(layout.communication_index, 1)):
        if carrier.written(index, subindex) and not (maps_it and index == layout.mapping_index):
            is_cob_id = (index, subindex) == (layout.communication_index, 1)
            sdo.download_confirmed(index, subindex, value, ignored=COB_ID_NO_RTR if is_cob_id else 0)


def _maps(sdo: SdoChannel, layout: PdoLayout) -> bool:
    try:
        found = read_layout(sdo.upload, layout.communication_index, layout.mapping_index)
    except ConfigMismatch:  # what was never set may be of any kind
        return False
    return found.objects == layout.objects


def _require_layout(sdo: SdoChannel, layout: PdoLayout, where: str) -> None:
    found = read_layout(sdo.upload, layout.communication_index, layout.mapping_index)
    if found != layout:  # what is not written has to be there
        raise ConfigMismatch(
            f"{where}: PDO 0x{layout.communication_index:04X}/0x{layout.mapping_index:04X} has [{found}], "
            f"expected [{layout}], and can't be given it. Use the EDS of the drive's firmware version."
        )
