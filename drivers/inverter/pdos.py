"""The PDOs of an inverter, found by the objects they carry. No bus, no clock.

A run on the bus and the replay of a bus trace read the same frames by these.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from drivers.canopen.pdo_map import PdoCodec
from drivers.capability.carrier import RPDO, TPDO, Carrier
from drivers.capability.carrier_search import MODES_OF_OPERATION
from drivers.capability.plan import DrivePlan, plan_drive
from drivers.capability.speed_unit import speed_scale
from drivers.datasheet.file import EdsFile
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
    """Frames of one inverter, down and up.

    Parameters
    ----------
    settings
        The inverter as the rig file has it.

    Attributes
    ----------
    eds
        Its data sheet.
    plan
        What it has, and how it is used.
    velocity
        Scale of 0x606C.
    rpdos
        Identifiers of the RPDOs that carry the command.

    Raises
    ------
    ConfigMismatch
        If the EDS can't be read, the drive lacks what it can't do without, no TPDO can carry a further object to be
        recorded, or nobody says its unit of speed.
    """

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

    target: int = 0
    offset: int = 0

    @property
    def total(self) -> int:
        """Both together."""
        return self.target + self.offset


@dataclass(frozen=True, slots=True)
class TorqueOnBus:
    """Target torque and torque offset of a frame [Nm]; None what it does not carry."""

    target_nm: float | None
    offset_nm: float | None
