"""Parts of ``[inverters.NAME]`` that say what a drive's data sheet does not: units, and what somebody has accepted."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Self

from pydantic import Field, model_validator

from drivers.capability.speed_unit import SpeedUnit, SpeedUnitName
from drivers.inverter.settings import Acceptance
from hil.config.table import Positive, Table, Text
from hil.problems import Fault, refuse


class SpeedUnitTable(Table):
    """Unit of the velocity actual value 0x606C, from the drive's manual; over what its data sheet says."""

    unit: Annotated[SpeedUnitName, Field(strict=False)]
    counts_per_unit: Positive = 1.0
    increments_per_turn: Positive | None = None

    @property
    def speed_unit(self) -> SpeedUnit:
        """The unit as the drivers take it."""
        return SpeedUnit(self.unit, self.counts_per_unit, self.increments_per_turn)

    @model_validator(mode="after")
    def _resolution_where_it_counts(self) -> Self:
        per_turn = self.increments_per_turn
        if self.speed_unit.needs_increments and per_turn is None:
            refuse(
                [Fault("increments_per_turn", f"the increments of one turn, since unit is {self.unit.value!r}", None)]
            )
        if not self.speed_unit.needs_increments and per_turn is not None:
            refuse([Fault("increments_per_turn", f"no such key while unit is {self.unit.value!r}", per_turn)])
        return self


class RatedTorqueUnit(Enum):
    """Unit of the motor rated torque 0x6076; CiA 402 has the thousandth."""

    MILLI = "mNm"
    MICRO = "uNm"

    @property
    def nm(self) -> float:
        """One count [Nm]."""
        return {RatedTorqueUnit.MILLI: 1e-3, RatedTorqueUnit.MICRO: 1e-6}[self]


class AcceptanceTable(Table):
    """Who accepted that it is missing, and why."""

    by: Text
    why: Text

    @property
    def acceptance(self) -> Acceptance:
        """The acceptance as the drivers take it."""
        return Acceptance(self.by, self.why)


class AcceptedTable(Table):
    """What a drive lacks, by name; see `drivers.inverter.stop_proof`."""

    heartbeat_consumer: AcceptanceTable | None = None
    rpdo_deadline: AcceptanceTable | None = None
    abort_connection: AcceptanceTable | None = None
    supported_modes: AcceptanceTable | None = None

    @property
    def by_name(self) -> dict[str, Acceptance]:
        """What is accepted."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: table.acceptance for name, table in given.items() if table is not None}
