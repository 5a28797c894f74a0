"""A driveline model: nominal parameters with what they are trusted to, and effects beyond them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from estimator.errors import BadModel
from estimator.physics.catalogue import EFFECTS, effect_problems
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
from estimator.physics.machine import Prior, part_problems, prior_problems
from estimator.physics.own_law import LawName
from estimator.signals.record import FloatArray, Record

__all__ = [
    "STRICTLY_POSITIVE",
    "DrivelineModel",
    "EffectValue",
    "ExternalPlant",
    "Load",
    "Motion",
    "Parameter",
    "Prior",
    "Structure",
    "load_inertia",
    "natural_frequencies_rad_s",
    "parameter_dimension",
    "parameter_unit",
    "unit",
]


class ExternalPlant(Protocol):
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
    has : frozenset of str, or None
        The machine's parts, of `machine.PARTS`; None where nobody says, and structure and signals imply them.
    priors : mapping of effect name to Prior
        Odds and sizes of effects that a person knows better than is usual (``prior``).

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
    plant: ExternalPlant | None = None
    has: frozenset[str] | None = None
    priors: Mapping[str, Prior] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", {self.own(name): values for name, values in self.effects.items()})
        problems = [*self._parameter_problems(), *self._effect_problems(), *self._prior_problems()]
        problems += part_problems(self.has, self.effects)
        if not isinstance(self.load, Load) and not math.isfinite(self.load):
            problems.append(f"load.constant: expected 'own', 'shared' or a finite number, got {self.load}")
        problems = problems or self._left_over_problems()
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

    def _left_over_problems(self) -> list[str]:
        """Refuse effects that leave nothing of a parameter that no line is without, such as its inertia."""
        line = self.values()
        return [
            f"effects.{name}: expected values that leave {parameter} = {line[parameter]:g} greater than 0, got "
            f"{', '.join(f'{key} = {each.value}' for key, each in values.items())}, which leave {min(spans):g}"
            for name, values in self.effects.items()
            for parameter, spans in self._spans_with(name, values, line).items()
            if parameter in STRICTLY_POSITIVE and min(spans) <= 0.0
        ]

    def _spans_with(
        self, name: str, values: Mapping[str, EffectValue], line: Mapping[str, float]
    ) -> dict[str, list[float]]:
        """Return between what an effect has the line's parameters, by name.

        Its values alone are asked: a tolerance and an interval say how little is known, not what a line has, and a fit
        finds no line beyond.
        """
        given = {each.name: each.null for each in EFFECTS[name].parameters} | {k: v.value for k, v in values.items()}
        described = EFFECTS[name].described(self, EFFECTS[name].completed(given), line)
        return {parameter: [end for span in spans for end in span] for parameter, spans in described.items()}

    def _prior_problems(self) -> list[str]:
        known = ", ".join([*EFFECTS, *self.laws])
        return [
            problem
            for name, prior in self.priors.items()
            for problem in (
                prior_problems(EFFECTS[self.own(name)], prior)
                if name in EFFECTS or name in self.laws
                else [f"priors.{name}: unknown effect, expected one of {known}"]
            )
        ]

    def prior(self, name: str) -> Prior:
        """Return what a person knows of an effect before any recording is seen; nothing is a ``Prior()``.

        ``odds`` is p / (1 - p), or None: as usual. ``sizes`` holds the 95 % range of each parameter that has one, in
        its unit as in the model file.
        """
        return self.priors.get(name, Prior())

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
    return problems or [f"parameters.{name}.{problem}" for problem in _trust_problems(parameter)]


def _trust_problems(parameter: Parameter) -> list[str]:
    """Return what is wrong with the tolerance of a parameter or its interval, each with the key first."""
    value, ci95, tolerance = parameter.value, parameter.ci95, parameter.tolerance
    if ci95 is not None:
        holds = all(math.isfinite(end) for end in ci95) and ci95[0] <= value <= ci95[1]
        return [] if holds else [f"ci95: expected two finite numbers with the value, {value}, between them, got {ci95}"]
    if not 0 <= tolerance < 1:
        return [f"tolerance: expected a relative tolerance from 0 up to 1, got {tolerance}"]
    if tolerance > 0 and value == 0:
        return [
            f"tolerance: expected 0 for a value of 0, of which every share is 0, got {tolerance}: write tolerance = 0 "
            "where there is none, or in its place the interval in which it may lie, such as ci95 = [0.0, 0.5]"
        ]
    return []
