"""The driveline model: structure, parameters with the tolerance they are trusted to, and effects beyond it.

Equations of motion, reflected to the motor shaft (translation: read kg, N, m, N s/m)::

    two_mass   J_M dw_M/dt = T - b_M w_M - T_S          one_mass   J_M dw_M/dt = T - b_M w_M - T_0
               J_L dw_L/dt = T_S - b_L w_L - T_0
               T_S = k (phi_M - phi_L) + c (w_M - w_L)

    three_mass a mass J_2 between shaft and load, and a second shaft k_2, c_2 from it to the load

    joint      T = k phi + c dphi/dt - T_0: the twist phi is imposed, the torque T is measured

``T_0`` is the constant load torque; it and the initial state are unknown in every recording, unless the model says that
recordings share it, or what it is.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Protocol

import numpy as np

from estimator.errors import BadModel
from estimator.physics.law_name import LawName
from estimator.signals.record import FloatArray, Record

if TYPE_CHECKING:
    from estimator.physics.inputs import Case


class Structure(Enum):
    """How many inertias the driveline has, a joint none; the value is the name in the model file."""

    ONE_MASS = "one_mass"
    TWO_MASS = "two_mass"
    THREE_MASS = "three_mass"
    JOINT = "joint"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Nominal parameters of the structure, in the order used everywhere."""
        return _PARAMETER_NAMES[self]


_PARAMETER_NAMES = {
    Structure.ONE_MASS: ("J_M", "b_M"),
    Structure.TWO_MASS: ("J_M", "J_L", "k", "c", "b_M", "b_L"),
    Structure.THREE_MASS: ("J_M", "J_2", "J_L", "k", "c", "k_2", "c_2", "b_M", "b_L"),
    Structure.JOINT: ("k", "c"),
}

STRICTLY_POSITIVE = frozenset({"J_M", "J_2", "J_L", "k", "k_2"})
"""Parameters that can't be zero; the others can't be negative."""


class Motion(Enum):
    """Rotation (kg m^2, Nm, rad) or translation (kg, N, m)."""

    ROTATION = "rotation"
    TRANSLATION = "translation"


_UNITS = {
    Motion.ROTATION: {
        "inertia": "kg m^2",
        "stiffness": "Nm/rad",
        "damping": "Nm s/rad",
        "torque": "Nm",
        "angle": "rad",
        "speed": "rad/s",
        "acceleration": "rad/s^2",
        "per_angle_squared": "1/rad^2",
        "quadratic_drag": "Nm s^2/rad^2",
        "per_torque": "1/Nm",
    },
    Motion.TRANSLATION: {
        "inertia": "kg",
        "stiffness": "N/m",
        "damping": "N s/m",
        "torque": "N",
        "angle": "m",
        "speed": "m/s",
        "acceleration": "m/s^2",
        "per_angle_squared": "1/m^2",
        "quadratic_drag": "N s^2/m^2",
        "per_torque": "1/N",
    },
}

_DIMENSIONS = {
    "J_M": "inertia",
    "J_2": "inertia",
    "J_L": "inertia",
    "k": "stiffness",
    "c": "damping",
    "k_2": "stiffness",
    "c_2": "damping",
    "b_M": "damping",
    "b_L": "damping",
}


def unit(dimension: str, motion: Motion) -> str:
    """Return the unit of a quantity; a dimension that is not mechanical, such as ``"s"``, is its own unit."""
    return _UNITS[motion].get(dimension, dimension)


def parameter_dimension(name: str) -> str:
    """Return the dimension of a nominal parameter, for example ``inertia`` for ``J_M``."""
    return _DIMENSIONS[name]


def parameter_unit(name: str, motion: Motion) -> str:
    """Return the unit of a nominal parameter, for example ``kg m^2`` for ``J_M``."""
    return unit(parameter_dimension(name), motion)


class Load(Enum):
    """Whose the constant load torque is, where its size is unknown; the value is the word in the model file."""

    OWN = "own"
    SHARED = "shared"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A nominal value [SI] and the relative tolerance within which re-tuning it is no missing physics."""

    value: float
    tolerance: float


@dataclass(frozen=True, slots=True)
class EffectValue:
    """One parameter of an effect: its value and, where it was estimated, its 95 % interval.

    ``tolerance`` is the share of the value within which re-tuning it is no missing physics; 0 holds it.
    """

    value: float
    ci95: tuple[float, float] | None = None
    tolerance: float = 0.0


class Plant(Protocol):
    """A line that is simulated elsewhere, as by another program: its structure and values are not known here."""

    @property
    def starts(self) -> Collection[str]:
        """What of the initial state can be set: names of attributes of ``start.Start``."""

    def simulated(self, record: Record, cases: Sequence[Case]) -> FloatArray:
        """Simulate the recorded output of a recording, as its sensor shows it, under each case; shape (K, N)."""


@dataclass(frozen=True, slots=True)
class DrivelineModel:
    """A driveline as the model file describes it.

    Attributes
    ----------
    parameters : mapping of name to Parameter
        Exactly ``structure.parameter_names``.
    effects : mapping of effect name to mapping of parameter name to EffectValue
        Physics beyond the nominal model; empty for a nominal one.
    gear_ratio : float or None
        Motor turns per wheel turn.
    load : Load or float
        The constant load torque: unknown, of each recording or of all of them together, or its value [Nm].
    laws : tuple of LawName
        A user's own laws, which no other model has (``own_law.named``).
    plant : Plant or None
        What simulates the line in the place of its equations: structure and parameters are then those of a line that
        answers much as it does, by which noise, scales and starts are judged.

    Raises
    ------
    BadModel
        With every fault of the model, one per line.
    """

    structure: Structure
    parameters: Mapping[str, Parameter]
    motion: Motion = Motion.ROTATION
    effects: Mapping[str, Mapping[str, EffectValue]] = field(default_factory=dict)
    gear_ratio: float | None = None
    load: Load | float = Load.OWN
    laws: tuple[LawName, ...] = ()
    plant: Plant | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", {self.own(name): values for name, values in self.effects.items()})
        problems = [*self._parameter_problems(), *self._effect_problems()]
        if not isinstance(self.load, Load) and not math.isfinite(self.load):
            problems.append(f"load.constant: expected 'own', 'shared' or a finite number, got {self.load}")
        if problems:
            raise BadModel("\n".join(problems))

    def _parameter_problems(self) -> list[str]:
        expected = self.structure.parameter_names
        listed = ", ".join(expected)
        problems = [
            f"parameters.{name}: missing, {self.structure.value} needs {listed}"
            for name in expected
            if name not in self.parameters
        ]
        problems += [
            f"parameters.{name}: unknown, {self.structure.value} has {listed}"
            for name in self.parameters
            if name not in expected
        ]
        for name, parameter in self.parameters.items():
            problems += _value_problems(name, parameter)
        return problems

    def _effect_problems(self) -> list[str]:
        from estimator.physics.catalogue import effect_problems

        return [problem for name, values in self.effects.items() for problem in effect_problems(name, values, self)]

    def own(self, name: str) -> str:
        """Return the name of an effect as this model knows it: one of its own laws by the name that knows the law."""
        return next((law for law in self.laws if law == name), name)

    def values(self) -> dict[str, float]:
        """Nominal parameter values alone."""
        return {name: self.parameters[name].value for name in self.structure.parameter_names}


def natural_frequencies_rad_s(values: Mapping[str, float]) -> FloatArray:
    """Return the undamped natural frequencies of the line, lowest first [rad/s]; a single 0 without two masses."""
    if "J_L" not in values:
        return np.zeros(1)
    chain = [("J_M", "k"), ("J_2", "k_2"), ("J_L", "")] if "J_2" in values else [("J_M", "k"), ("J_L", "")]
    stiffness = np.zeros((len(chain), len(chain)))
    for i, (_, spring) in enumerate(chain[:-1]):
        stiffness[i : i + 2, i : i + 2] += values[spring] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    root = np.sqrt([values[name] for name, _ in chain])
    squares = np.linalg.eigvalsh(stiffness / np.outer(root, root))
    frequencies: FloatArray = np.sqrt(np.maximum(squares[1:], 0.0))
    return frequencies


def load_inertia(model: DrivelineModel) -> str:
    """Return the name of the inertia that the load's mass is part of."""
    return "J_M" if model.structure is Structure.ONE_MASS else "J_L"


def _value_problems(name: str, parameter: Parameter) -> list[str]:
    problems = []
    low = "greater than 0" if name in STRICTLY_POSITIVE else "0 or greater"
    fits = parameter.value > 0 if name in STRICTLY_POSITIVE else parameter.value >= 0
    if not (math.isfinite(parameter.value) and fits):
        problems.append(f"parameters.{name}.value: expected a finite number {low}, got {parameter.value}")
    if not 0 <= parameter.tolerance < 1:
        problems.append(
            f"parameters.{name}.tolerance: expected a relative tolerance from 0 up to 1, got {parameter.tolerance}"
        )
    return problems
