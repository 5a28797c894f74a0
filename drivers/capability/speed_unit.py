"""The unit of the velocity actual value 0x606C: the drive's own, or what the rig file states. No bus.

::

    0x60A9             power of ten, angle, time (CiA 303-2)
    0x608B, 0x608C     power of ten, dimension (CiA 402 version 2): A3 rev/s, A4 rev/min
    rig file           unit, counts per unit, increments per turn

Increments are an angle with a resolution only, which the data sheet's default is no proof of: so they are stated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import Final

from drivers.capability.plan import DrivePlan
from drivers.capability.table import Function
from drivers.errors import ConfigMismatch
from drivers.scaling import IntegerType, VelocityScale

SI_UNIT_VELOCITY: Final = 0x60A9
NOTATION_INDEX, DIMENSION_INDEX = 0x608B, 0x608C

INCREMENTS: Final = 0xB5  # code of increments in the field of the angle (CiA 402)

_DIMENSIONS: Final = MappingProxyType({0xA3: 2.0 * math.pi, 0xA4: 2.0 * math.pi / 60.0})
"""Velocity dimension index (CiA 402 version 2, annex B) to rad/s."""


class SpeedUnitName(Enum):
    """A unit of speed by its name in the rig file."""

    RPM = "rpm"
    REV_PER_S = "rev/s"
    RAD_PER_S = "rad/s"
    DEG_PER_S = "deg/s"
    INCREMENTS_PER_S = "increments/s"
    INCREMENTS_PER_MS = "increments/ms"


_RAD_S: Final = MappingProxyType(
    {
        SpeedUnitName.RPM: 2.0 * math.pi / 60.0,
        SpeedUnitName.REV_PER_S: 2.0 * math.pi,
        SpeedUnitName.RAD_PER_S: 1.0,
        SpeedUnitName.DEG_PER_S: math.pi / 180.0,
        SpeedUnitName.INCREMENTS_PER_S: 2.0 * math.pi,  # per turn, of which increments_per_turn makes the increment
        SpeedUnitName.INCREMENTS_PER_MS: 2000.0 * math.pi,
    }
)


@dataclass(frozen=True, slots=True)
class SpeedUnit:
    """Unit of 0x606C as somebody states it."""

    unit: SpeedUnitName  # its name
    counts_per_unit: float = 1.0  # counts of one unit
    increments_per_turn: float | None = None  # of the encoder, where the unit counts increments

    @property
    def needs_increments(self) -> bool:
        """Whether the unit counts increments of an encoder, whose number per turn must be given."""
        return self.unit in (SpeedUnitName.INCREMENTS_PER_S, SpeedUnitName.INCREMENTS_PER_MS)

    @property
    def scale(self) -> VelocityScale:
        """The factor from counts to rad/s."""
        return VelocityScale(_RAD_S[self.unit] / (self.counts_per_unit * (self.increments_per_turn or 1.0)))

    def __str__(self) -> str:
        per_turn = "" if self.increments_per_turn is None else f" at {self.increments_per_turn:g} per turn"
        counts = "" if self.counts_per_unit == 1.0 else f"{self.counts_per_unit:g} counts of one "
        return f"{counts}{self.unit.value}{per_turn}"


def described_scale(plan: DrivePlan, where: str) -> VelocityScale | None:
    """Give the scale that the data sheet's own values make; None if they make none."""
    values = {part.index: plan.sheet.value(part.index) for part in plan.abilities[Function.SPEED_UNIT].parts}
    return scale_of(values, where)


def scale_of(values: dict[int, int | None], where: str) -> VelocityScale | None:
    """Give the scale that values of 0x60A9, or of 0x608B and 0x608C, make; None if they make none."""
    unit = values.get(SI_UNIT_VELOCITY)
    if unit is not None:
        try:
            return VelocityScale.from_object(unit, where)
        except ConfigMismatch:
            return None
    notation, dimension = values.get(NOTATION_INDEX), values.get(DIMENSION_INDEX)
    if notation is None or dimension is None or dimension not in _DIMENSIONS or abs(notation) > 9:
        return None
    return VelocityScale(10.0**notation * _DIMENSIONS[dimension])


def speed_scale(plan: DrivePlan, stated: SpeedUnit | None, where: str) -> VelocityScale:
    """Give the scale of 0x606C: what the rig file states, else what the data sheet says."""
    if stated is not None:
        return stated.scale
    described = described_scale(plan, where)
    if described is None:
        raise ConfigMismatch(
            f"{where}: expected the unit of the velocity actual value 0x606C, {unit_in_words(plan)}. State it in the "
            f"rig file from the drive's manual, such as: {speed_unit_line(plan)}"
        )
    return described


def unit_in_words(plan: DrivePlan) -> str:
    """Say what the data sheet has of the unit of speed, where it is no unit this program knows."""
    ability = plan.abilities[Function.SPEED_UNIT]
    if not ability.given:
        return f"the {plan.sheet.kind} has neither 0x60A9 nor 0x608B and 0x608C"
    values = []
    for part in ability.parts:
        value = plan.sheet.value(part.index)
        values.append(f"0x{part.index:04X} {'without a value' if value is None else f'0x{value:X}'}")
    return f"the {plan.sheet.kind} has {' and '.join(values)}, which is no angle per time"


def speed_unit_line(plan: DrivePlan) -> str:
    """Write a line of the rig file that states the unit, as near as the data sheet leads to it."""
    unit = plan.sheet.value(SI_UNIT_VELOCITY)
    per_turn = _increments_per_turn(plan)
    if unit is not None and unit >> 16 & 0xFF == INCREMENTS:
        return _line(SpeedUnitName.INCREMENTS_PER_S, unit, per_turn or 4096.0)
    return 'speed_unit = { unit = "rpm" }'


def _line(name: SpeedUnitName, unit: int, per_turn: float) -> str:
    prefix = IntegerType.INTEGER8.decode(bytes([unit >> 24 & 0xFF]))
    counts = f", counts_per_unit = {10.0**-prefix:g}" if prefix else ""
    return f'speed_unit = {{ unit = "{name.value}"{counts}, increments_per_turn = {per_turn:g} }}'


def _increments_per_turn(plan: DrivePlan) -> float | None:
    """Read the encoder resolution, 0x608F or 0x6090, from the data sheet."""
    for index in (0x608F, 0x6090):
        increments, turns = plan.sheet.value(index, 1), plan.sheet.value(index, 2)
        if increments and turns and increments > 1:
            return increments / turns
    return None
