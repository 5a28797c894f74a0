"""What simulated inverters drive: the plant they see, a rigid one, and the model file behind a driveline."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import Location, OutputKind
from hil.config.model_file import read_model
from hil.config.rig_file import SimulationTable
from hil.errors import ModelFileError, UsageError


class Plant(Protocol):
    """A driveline as the simulated rig sees it; all values reflected to the motor shaft."""

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the plant run with both inverters' torques held [Nm] for ``duration_s`` [s]."""


@runtime_checkable
class SensedPlant(Plant, Protocol):
    """A driveline with further places to measure at."""

    def measured(self, kind: OutputKind, at: Location) -> float:
        """Return what a sensor there shows now [rad/s, rad, Nm, rad/s^2]."""


class RigidPlant:
    """One inertia with viscous drag: ``J dw/dt = T1 + T2 - b w``; the shaft is rigid.

    Stepped by the exact solution for held torque, so the result does not depend on the period.
    """

    def __init__(self, inertia_kg_m2: float, drag_nm_s: float, speed_rad_s: float = 0.0) -> None:
        self._time_constant_s = inertia_kg_m2 / drag_nm_s
        self._drag_nm_s = drag_nm_s
        self._speed_rad_s = speed_rad_s

    @property
    def speed_rad_s(self) -> float:
        """True motor speed now [rad/s]."""
        return self._speed_rad_s

    def advance(self, torque_nm: tuple[float, float], duration_s: float) -> None:
        """Let the plant run with both inverters' torques held [Nm] for ``duration_s`` [s]."""
        final_rad_s = sum(torque_nm) / self._drag_nm_s
        decay = math.exp(-duration_s / self._time_constant_s)
        self._speed_rad_s = final_rad_s + (self._speed_rad_s - final_rad_s) * decay


DEFAULT_BUS = DrivelineModel(
    structure=Structure.TWO_MASS,
    parameters={
        "J_M": Parameter(1.6, 0.2),
        "J_L": Parameter(100.0, 0.2),
        "k": Parameter(4200.0, 0.2),
        "c": Parameter(9.0, 0.2),
        "b_M": Parameter(0.35, 0.2),
        "b_L": Parameter(0.9, 0.2),
    },
    gear_ratio=5.6,
)
"""A hybrid bus of 14 t, gear ratio 5.6, wheel radius 0.48 m, reflected to the motor shaft.

Assumed, for the paper gives no parameter values: first resonance 8.2 Hz, inside the 5 to 50 Hz band it names.
"""


@dataclass(frozen=True, slots=True)
class EffectSpec:
    """An effect put into the simulated rig: its name in the catalogue and the parameters given for it."""

    name: str
    parameters: Mapping[str, float]

    @classmethod
    def parse(cls, text: str) -> EffectSpec:
        """Read ``NAME[:k=v,...]``."""
        name, _, rest = text.partition(":")
        if not name.strip():
            raise UsageError(f"effect {text!r}: expected NAME:key=number, got no name. List them by: hil effects")
        parameters: dict[str, float] = {}
        for part in rest.split(",") if rest else ():
            key, value = _parameter(text, part)
            if key in parameters:
                raise UsageError(f"effect {text!r}: expected {key!r} once, got twice. Leave one out.")
            parameters[key] = value
        return cls(name.strip(), parameters)


def simulation_model(table: SimulationTable, trust_laws: bool = False) -> DrivelineModel:
    """Model of the simulated driveline: the rig file's, or the default bus; its own laws run only where trusted."""
    if table.model is None:
        return DEFAULT_BUS
    file = read_model(table.model, trust_laws)
    if file.on_bench:
        raise ModelFileError(table.model, "structure | expected a driveline for a rig to drive | got 'joint'")
    return file.model


def _parameter(text: str, part: str) -> tuple[str, float]:
    key, _, value = part.partition("=")
    try:
        return key.strip(), float(value)
    except ValueError as error:
        raise UsageError(
            f"effect {text!r}: expected key=number, got {part!r}. Write NAME:key=number,key=number."
        ) from error
