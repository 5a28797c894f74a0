"""A driveline model: nominal parameters with the tolerance they are trusted to, and effects beyond them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from estimator.errors import BadModel
from estimator.physics.catalogue import effect_problems
from estimator.physics.driveline import (
    STRICTLY_POSITIVE,
    Case,
    EffectValue,
    Load,
    Motion,
    Parameter,
    Structure,
    load_inertia,
    natural_frequencies_rad_s,
    parameter_dimension,
    parameter_unit,
    unit,
)
from estimator.physics.own_law import LawName
from estimator.signals.record import FloatArray, Record

__all__ = [
    "STRICTLY_POSITIVE",
    "DrivelineModel",
    "EffectValue",
    "Load",
    "Motion",
    "Parameter",
    "Plant",
    "Structure",
    "load_inertia",
    "natural_frequencies_rad_s",
    "parameter_dimension",
    "parameter_unit",
    "unit",
]


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
        A user's own laws, which no other model has (``layout.named``).
    plant : Plant or None
        What simulates the line in the place of its equations: structure and parameters are then those of a line that
        answers much as it does, by which noise, scales and starts are judged.

    Raises
    ------
    BadModel
        With every fault of the model, one per line.
    """

    structure: Structure  # how many masses, or a joint
    parameters: Mapping[str, Parameter]
    motion: Motion = Motion.ROTATION  # rotation or translation: the units
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
        return [
            problem
            for name, values in self.effects.items()
            for problem in effect_problems(name, values, self.structure, self.laws)
        ]

    def own(self, name: str) -> str:
        """Return the name of an effect as this model knows it: one of its own laws by the name that knows the law."""
        return next((law for law in self.laws if law == name), name)

    def values(self) -> dict[str, float]:
        """Nominal parameter values alone."""
        return {name: self.parameters[name].value for name in self.structure.parameter_names}


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
