"""What a simulated inverter takes from its EDS: power-on values, the scale of its speed, the ranges of its objects."""

from __future__ import annotations

from drivers.capability.plan import plan_drive
from drivers.capability.speed_unit import described_scale, speed_scale
from drivers.datasheet.file import EdsFile
from drivers.scaling import IntegerType, VelocityScale
from hil.simulator.inverter_device import PARAMETERS
from hil.simulator.inverter_settings import SimulatedInverter

MAX_TORQUE = 0x6072
SUPPORTED_MODES = 0x6502

INTEGERS = frozenset(IntegerType)
"""Data types that are simulated by value."""


def power_on_values(eds: EdsFile) -> dict[int, int]:
    """Power-on values of what the device holds, from the EDS where it has them."""
    described = {index: eds.sheet.value(index) for index in (*PARAMETERS, SUPPORTED_MODES)}
    known = {index: value for index, value in described.items() if value is not None}
    if not known.get(MAX_TORQUE):
        known.pop(MAX_TORQUE, None)  # a place left free: no drive is made to give no torque
    return {**PARAMETERS, **known}


def velocity_scale(eds: EdsFile, settings: SimulatedInverter) -> VelocityScale:
    """Scale of its speed: its EDS's, else what the rig file states of it."""
    plan = plan_drive(eds.sheet)
    where = f"simulated inverter, node {settings.node_id}"
    return described_scale(plan, where) or speed_scale(plan, settings.speed_unit, where)


def fitting(value: int, data_type: int) -> int:
    """Give a value in the range of its object: makers have narrower ones than CiA 402."""
    if data_type not in INTEGERS:
        return value
    kind = IntegerType(data_type)
    return min(max(value, kind.low), kind.high)
