"""The tables ``[[channels]]`` of a rig file: further measured quantities, each a column of every recording.

A channel comes from an object of an inverter, which a TPDO carries, or from a register of the PLC's map. The model
file's ``[signals] outputs`` names the columns that take part in a fit.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import MappingProxyType
from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from drivers.capability.carrier import ObjectId, object_name
from drivers.plc.register_map import IN_SI, NUMBER, RegisterMap
from estimator.signals.record import Location, OutputKind
from hil.config.table import FileTable, Text
from hil.problems import Fault, refuse
from hil.recording import columns

UNITS: Final = MappingProxyType(
    {
        OutputKind.SPEED: ("rad/s", "_rad_s"),
        OutputKind.POSITION: ("rad", "_rad"),
        OutputKind.TORQUE: ("Nm", "_nm"),
        OutputKind.ACCELERATION: ("rad/s^2", "_rad_s2"),
    }
)
"""Unit of each kind of channel, and what the name of its column ends in."""


LEAST_SCALE, MOST_SCALE = 1e-12, 1e12
"""Sizes of a scale: any unit of an integer has one between them, and a cell beyond 1e30 can't be read back."""


class ChannelTable(FileTable):
    """One channel; its values are in SI units, reflected to the motor shaft.

    The key ``register`` is `register_name` here: pydantic has a use of its own for that name.
    """

    column: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]  # its column in a recording
    kind: Annotated[OutputKind, Field(strict=False)]  # what is measured
    at: Annotated[Location, Field(strict=False)]  # where it is measured
    inverter: Literal["m1", "m2"] | None = None  # the object of an inverter that a TPDO carries
    object: Annotated[int, Field(ge=0x1000, le=0xFFFF)] | None = None
    subindex: Annotated[int, Field(ge=0, le=255)] = 0  # the object of an inverter that a TPDO carries
    register_name: Annotated[Text | None, Field(alias="register")] = None
    scale: float | None = None  # of an object

    @property
    def unit(self) -> str:
        """Its unit in a recording."""
        return UNITS[self.kind][0]

    @property
    def object_id(self) -> ObjectId | None:
        """Index and subindex of its object; None for a register."""
        return None if self.object is None else (self.object, self.subindex)

    @property
    def source(self) -> str:
        """Where it comes from, in words."""
        if self.object is None:
            return f"PLC register {self.register_name}"
        return f"{self.inverter} {object_name(self.object, self.subindex)}"

    def factor(self, register_map: RegisterMap) -> float:
        """Return what a value is multiplied by: the count of an object, or a register's value in the map's unit."""
        given = 1.0 if self.scale is None else self.scale
        if self.register_name is None:
            return given
        return given * IN_SI[self.unit][register_map[self.register_name].unit]

    def register_fault(self, register_map: RegisterMap) -> str:
        """Say why the map's register can't be this channel; empty where it can."""
        register = register_map.registers.get(self.register_name or "")
        if register is None:
            listed = ", ".join(sorted(register_map.registers))
            return f"expected one of the registers of map {register_map.name!r}: {listed} | got {self.register_name!r}"
        if register.type not in NUMBER:
            return (
                f"expected a register that holds a number | got {self.register_name!r}, of type {register.type.value}"
            )
        if register.unit not in IN_SI[self.unit]:
            units = " or ".join(IN_SI[self.unit])
            return f"expected a register in {units}, since kind is {self.kind.value!r} | got one in {register.unit}"
        return ""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        refuse(self._faults())
        return self

    def _faults(self) -> Iterator[Fault]:
        is_torque = self.kind is OutputKind.TORQUE
        if self.kind not in UNITS or self.at is (Location.MOTOR if is_torque else Location.SHAFT):
            expected = "speed, position or acceleration at the motor or the load, or torque at the shaft or the load"
            yield Fault("kind", expected, f"{self.kind.value} at the {self.at.value}")
        elif not self.column.endswith(UNITS[self.kind][1]):
            yield Fault("column", f"a name that ends in {UNITS[self.kind][1]}, its unit", self.column)
        if self.column in columns.UNITS:
            yield Fault("column", "another name than a column that every recording has", self.column)
        if self.scale is not None and not LEAST_SCALE <= abs(self.scale) <= MOST_SCALE:
            yield Fault("scale", f"a number of {LEAST_SCALE:g} to {MOST_SCALE:g}, or its negative", self.scale)
        yield from self._source_faults()

    def _source_faults(self) -> Iterator[Fault]:
        if (self.object is None) == (self.register_name is None):
            got = "neither" if self.object is None else "both"
            yield Fault("", "either object, with inverter and scale, or register", got)
        elif self.object is None:
            given = {"inverter": self.inverter, "subindex": self.subindex or None}
            for key in (key for key, value in given.items() if value is not None):
                yield Fault(key, "no such key next to register", given[key])
        else:
            for key in (key for key in ("inverter", "scale") if getattr(self, key) is None):
                yield Fault(key, "this key next to object", None)
