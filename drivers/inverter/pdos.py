"""The two PDOs of an inverter as its EDS has them, found by the objects they carry. No bus, no clock.

A run on the bus and the replay of a bus trace read the same frames by these.
"""

from __future__ import annotations

from drivers.canopen.pdo_map import RPDO_COMMUNICATION, RPDO_MAPPING, TPDO_COMMUNICATION, TPDO_MAPPING, PdoCodec
from drivers.datasheet.file import EdsFile
from drivers.errors import ConfigMismatch
from drivers.inverter.feedback import FeedbackReceiver
from drivers.scaling import TorqueScale, VelocityScale

COMMAND_OBJECTS = (0x6040, 0x6071, 0x60B2)
"""What the RPDO carries: controlword, base torque, PRBS."""

FEEDBACK_OBJECTS = (0x6041, 0x6077, 0x606C)
"""What the TPDO carries, perhaps beside other objects: statusword, torque, speed."""


def command_codec(eds: EdsFile, where: str) -> PdoCodec:
    """Find the RPDO that carries the torque command.

    Raises
    ------
    ConfigMismatch
        If the EDS has none, or maps another object into it.
    """
    codec = eds.codec(eds.pdo_carrying(RPDO_COMMUNICATION, RPDO_MAPPING, *COMMAND_OBJECTS), where)
    for mapped in codec.layout.objects:
        if mapped.index not in COMMAND_OBJECTS:
            raise ConfigMismatch(
                f"EDS {eds.path}: the RPDO maps {mapped}, which this program has no value for; expected "
                "0x6040, 0x6071 and 0x60B2 alone. Take the object out of the mapping in the EDS."
            )
    return codec


def feedback_codec(eds: EdsFile, where: str) -> PdoCodec:
    """Find the TPDO that carries the feedback.

    Raises
    ------
    ConfigMismatch
        If the EDS has none.
    """
    return eds.codec(eds.pdo_carrying(TPDO_COMMUNICATION, TPDO_MAPPING, *FEEDBACK_OBJECTS), where)


def feedback_receiver(eds: EdsFile, codec: PdoCodec, torque: TorqueScale) -> FeedbackReceiver:
    """Build what reads the TPDO's frames in SI units; the velocity's scale is the EDS's.

    Raises
    ------
    ConfigMismatch
        If the EDS's SI unit velocity, 0x60A9, is none that is known here.
    """
    return FeedbackReceiver(codec, torque, VelocityScale.from_object(eds.default(0x60A9), f"EDS {eds.path}"))
