"""The two PDOs of an inverter, found by the objects they carry. No bus, no clock.

A run on the bus and the replay of a bus trace read the same frames by these.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.canopen.pdo_map import PdoCodec
from drivers.capability.carrier import RPDO, TPDO, Carrier
from drivers.capability.plan import DrivePlan, plan_drive
from drivers.capability.speed_unit import speed_scale
from drivers.datasheet.file import EdsFile
from drivers.inverter.cia402 import Command
from drivers.inverter.feedback import FeedbackReceiver
from drivers.inverter.settings import InverterSettings
from drivers.scaling import TorqueScale, VelocityScale
from drivers.torque_guard import GuardedTorque

CONTROLWORD, TARGET_TORQUE, TORQUE_OFFSET = 0x6040, 0x6071, 0x60B2


def command_codec(eds: EdsFile, where: str) -> PdoCodec:
    """Build packer and unpacker of the RPDO that carries the torque command in a run.

    Raises
    ------
    ConfigMismatch
        If there is none, and none can be mapped.
    """
    return eds.codec(plan_drive(eds.sheet).carrier(RPDO).layout, where)


def feedback_codec(eds: EdsFile, where: str) -> PdoCodec:
    """Build packer and unpacker of the TPDO that carries the feedback in a run.

    Raises
    ------
    ConfigMismatch
        If there is none, and none can be mapped.
    """
    return eds.codec(plan_drive(eds.sheet).carrier(TPDO).layout, where)


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
    command, feedback
        Its RPDO and its TPDO.

    Raises
    ------
    ConfigMismatch
        If the EDS can't be read, the drive lacks what it can't do without, or nobody says its unit of speed.
    """

    def __init__(self, settings: InverterSettings) -> None:
        where = settings.where
        self.eds = EdsFile(settings.eds_path, settings.node_id)
        self.plan: DrivePlan = plan_drive(self.eds.sheet)
        self.command: Carrier = self.plan.carrier(RPDO)
        self.feedback: Carrier = self.plan.carrier(TPDO)
        self.velocity: VelocityScale = speed_scale(self.plan, settings.speed_unit, where)
        self._torque = TorqueScale(settings.rated_torque_nm)
        self._where = where
        self._rpdo: PdoCodec = command_codec(self.eds, where)
        self._tpdo: PdoCodec = feedback_codec(self.eds, where)

    @property
    def has_offset(self) -> bool:
        """Whether the PRBS goes into an object of its own."""
        return TORQUE_OFFSET in self._rpdo.indices

    def receiver(self) -> FeedbackReceiver:
        """Build what reads the TPDO's frames in SI units."""
        return FeedbackReceiver(self._tpdo, self._torque, self.velocity)

    def counts(self, torque: GuardedTorque) -> TorqueCounts:
        """Turn a command into counts; base and PRBS are summed where the drive has one object for both.

        Raises
        ------
        CommandRefused
            If a torque does not fit its object.
        """
        if self.has_offset:
            return TorqueCounts(
                self._torque.to_raw(torque.base_nm, self._where), self._torque.to_raw(torque.prbs_nm, self._where)
            )
        return TorqueCounts(self._torque.to_raw(torque.base_nm + torque.prbs_nm, self._where), 0)

    def pack(self, command: Command, counts: TorqueCounts) -> bytes:
        """Build the RPDO's frame; a filler is 0."""
        values = {CONTROLWORD: command.value, TARGET_TORQUE: counts.target, TORQUE_OFFSET: counts.offset}
        return self._rpdo.pack(tuple([values.get(index, 0) for index in self._rpdo.indices]))

    def unpack(self, data: bytes) -> TorqueOnBus:
        """Read the torque of an RPDO's frame.

        Raises
        ------
        ProtocolViolation
            If it has not the length of its mapping.
        """
        values = dict(zip(self._rpdo.indices, self._rpdo.unpack(data), strict=True))
        offset = values.get(TORQUE_OFFSET)
        return TorqueOnBus(
            self._torque.to_nm(values[TARGET_TORQUE]), None if offset is None else self._torque.to_nm(offset)
        )


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
    """Target torque and torque offset of a frame [Nm]; the offset is None where both are summed into the target."""

    target_nm: float
    offset_nm: float | None
