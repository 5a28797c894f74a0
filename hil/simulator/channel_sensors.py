"""The sensors behind a simulated rig's channels: read at each SYNC, handed on in counts and in a register's unit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from drivers.capability.carrier import ObjectId
from drivers.plc.register import Register, ValueType
from hil.config.channel_table import ChannelTable
from hil.config.rig_file import Rig
from hil.errors import UsageError
from hil.simulator.plant import Plant, SensedPlant

_OF_SENSORS = 2
"""Of a rig's random numbers: those of its nodes have streams of their own."""

_RANGES = {
    ValueType.UINT16: (0, (1 << 16) - 1),
    ValueType.INT16: (-(1 << 15), (1 << 15) - 1),
    ValueType.UINT32: (0, (1 << 32) - 1),
    ValueType.INT32: (-(1 << 31), (1 << 31) - 1),
}


class ChannelSensors:
    """The channels of one rig file on one plant.

    Parameters
    ----------
    rig
        With a table ``[simulation]``.
    plant
        The driveline.
    seed
        Of the noise.

    Raises
    ------
    UsageError
        If there are channels, and the driveline has nothing to measure but its motor's speed.
    BadModel
        If its structure has no such output.
    """

    def __init__(self, rig: Rig, plant: Plant, seed: int) -> None:
        self._tables = tuple(rig.channels)
        self._plant = _sensed(rig, plant) if self._tables else None
        self._map = rig.register_map
        self._noise = {} if rig.simulation is None else rig.simulation.channel_noise
        self._random = np.random.default_rng([seed, 0, _OF_SENSORS])
        self._read = {table.column: 0.0 for table in self._tables}
        self.sample()  # what a driveline has no place for is refused here, and not at the first SYNC

    def sample(self) -> None:
        """Read every sensor now."""
        if self._plant is not None:
            for table in self._tables:
                noise = self._noise.get(table.column, 0.0) * float(self._random.standard_normal())
                self._read[table.column] = self._plant.measured(table.kind, table.at) + noise

    def objects(self, inverter: str) -> Mapping[ObjectId, Callable[[], int]]:
        """Give what reads the objects of an inverter, in counts."""
        return {
            table.object_id: partial(self._count, table)
            for table in self._tables
            if table.inverter == inverter and table.object_id is not None
        }

    def registers(self) -> dict[str, float]:
        """Return what the PLC's registers hold, by name, in the unit of its map."""
        return {table.register_name: self._held(table) for table in self._tables if table.register_name is not None}

    def _count(self, table: ChannelTable) -> int:
        return round(self._read[table.column] / table.factor(self._map))

    def _held(self, table: ChannelTable) -> float:
        register = self._map[table.register_name or ""]
        return _converted(register, self._read[table.column] / table.factor(self._map))


def _sensed(rig: Rig, plant: Plant) -> SensedPlant:
    if not isinstance(plant, SensedPlant):
        listed = ", ".join(rig.channel_units)
        raise UsageError(
            f"rig {rig.name!r}, channels: expected a driveline that can be measured there, got one with a motor speed "
            f"alone ({listed}). Take [[channels]] out of this rig file."
        )
    return plant


def _converted(register: Register, value: float) -> float:
    """Convert as an analogue input does: in whole steps, and saturating."""
    if register.type not in _RANGES:
        return value
    step = 1.0 if register.scale is None else register.scale
    low, high = _RANGES[register.type]
    return min(max(round(value / step), low), high) * step
