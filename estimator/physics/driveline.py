"""A driveline's structure, nominal parameters and units: what effects and models are written in.

Equations of motion, reflected to the motor shaft (translation: read kg, N, m, N s/m)::

    two_mass   J_M dw_M/dt = T - b_M w_M - T_S          one_mass   J_M dw_M/dt = T - b_M w_M - T_0
               J_L dw_L/dt = T_S - b_L w_L - T_0
               T_S = k (phi_M - phi_L) + c (w_M - w_L)

    joint      T = k phi + c dphi/dt - T_0: the twist phi is imposed, the torque T is measured
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol

import numpy as np

from estimator.signals.record import FloatArray

STRICTLY_POSITIVE = frozenset({"J_M", "J_2", "J_L", "k", "k_2"})
"""Parameters that can't be zero; the others can't be negative."""

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

UNKNOWN_WITHIN = 10.0
"""Factor beyond its interval's ends within which an unknown parameter is fitted: the integration, whose steps suit the
values as they are given, still follows a spring ten times as stiff (0.6 rad of its mode in a step)."""


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


class Motion(Enum):
    """Rotation (kg m^2, Nm, rad) or translation (kg, N, m)."""

    ROTATION = "rotation"
    TRANSLATION = "translation"


UNITS = {
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


def unit(dimension: str, motion: Motion) -> str:
    """Return the unit of a quantity; a dimension that is not mechanical, such as ``"s"``, is its own unit."""
    return UNITS[motion].get(dimension, dimension)


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


def widened(ci95: tuple[float, float] | None, value: float) -> tuple[float, float] | None:
    """Return an interval that holds a value, in its unit; None where there is none."""
    return None if ci95 is None else (min(ci95[0], value), max(ci95[1], value))


@dataclass(frozen=True, slots=True)
class Parameter:
    """A nominal value [SI] and what it is trusted to: re-tuning it within that is no missing physics.

    That is a relative tolerance, or the 95 % interval to which it was measured; then the tolerance follows from it.
    """

    value: float  # in SI, at the motor shaft
    tolerance: float = 0.0  # relative, 0 for a value that is trusted exactly
    ci95: tuple[float, float] | None = None  # in SI, where it was measured

    def __post_init__(self) -> None:
        if self.ci95 is not None:
            reach = max(self.high - self.value, self.value - self.low)
            object.__setattr__(self, "tolerance", reach / self.value if self.value > 0.0 else math.inf)

    @classmethod
    def measured(cls, value: float, half_width: float, least_share: float) -> Parameter:
        """Return a measured value of 0 or more, by half its 95 % interval; trusted to no less than a share of it.

        An interval that is not finite is one of all that an unknown may be.
        """
        reach = max(half_width, least_share * value)
        reach = reach if math.isfinite(reach) else UNKNOWN_WITHIN * value
        return cls(value, ci95=(max(value - reach, 0.0), value + reach))

    def at(self, value: float) -> Parameter:
        """Return it at another value [SI]; what moves a value out of its interval was not known of: it is widened."""
        return replace(self, value=value, ci95=widened(self.ci95, value))

    @property
    def low(self) -> float:
        """Lower end of what it is trusted to."""
        return self.value * (1.0 - self.tolerance) if self.ci95 is None else self.ci95[0]

    @property
    def high(self) -> float:
        """Upper end of what it is trusted to."""
        return self.value * (1.0 + self.tolerance) if self.ci95 is None else self.ci95[1]

    @property
    def is_unknown(self) -> bool:
        """Whether its interval holds 0, or is wider than its value: nothing is known of it but that it is there."""
        return self.ci95 is not None and self.low < self.high and (self.low <= 0.0 or self.high - self.low > self.value)

    def bounds(self, may_be_zero: bool) -> tuple[float, float]:
        """Return within what a fit may change it; an unknown one far beyond its interval, where no physics forbids."""
        if not self.is_unknown:
            return self.low, self.high
        least = 0.0 if may_be_zero else (self.low if self.low > 0.0 else self.value) / UNKNOWN_WITHIN
        return least, UNKNOWN_WITHIN * self.high


@dataclass(frozen=True, slots=True)
class EffectValue:
    """One parameter of an effect: its value and, where it was estimated, its 95 % interval."""

    value: float  # in the parameter's unit
    ci95: tuple[float, float] | None = None  # in the same unit; None where it was given
    tolerance: float = 0.0  # relative, 0 for a value that is trusted exactly

    def at(self, value: float) -> EffectValue:
        """Return it at another value; see `Parameter.at`."""
        return replace(self, value=value, ci95=widened(self.ci95, value))


class Driveline(Protocol):
    """What an effect may know of the model that it is released in: all but the effects that this has already."""

    @property
    def structure(self) -> Structure:
        """How many inertias it has."""

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Nominal parameters by name."""

    @property
    def motion(self) -> Motion:
        """Rotation or translation."""

    @property
    def load(self) -> Load | float:
        """Whose the constant load torque is, or its value [Nm]."""

    @property
    def gear_ratio(self) -> float | None:
        """Motor turns per wheel turn."""

    def values(self) -> dict[str, float]:
        """Nominal parameter values alone."""


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
    return np.sqrt(np.maximum(squares[1:], 0.0))


def load_inertia(model: Driveline) -> str:
    """Return the name of the parameter that is the load's inertia; with one mass the whole line's."""
    return "J_M" if model.structure is Structure.ONE_MASS else "J_L"


@dataclass(frozen=True, slots=True)
class InitialCondition:
    """What is unknown in every recording: constant load torque [Nm] and initial state [rad, rad/s].

    Of a joint also the preload behind its gap [Nm].
    """

    load_torque_nm: float  # constant over the recording [Nm]
    angle_rad: float  # of the motor [rad]
    speed_rad_s: float  # of the motor [rad/s]
    twist_rad: float = 0.0  # of the first shaft [rad]
    load_speed_rad_s: float = 0.0  # of the load [rad/s]
    middle_twist_rad: float = 0.0  # of the second shaft [rad]; three masses
    middle_speed_rad_s: float = 0.0  # of the mass between the shafts [rad/s]; three masses
    preload_nm: float = 0.0  # torque in a joint before it is twisted [Nm]


@dataclass(frozen=True, slots=True)
class Case:
    """One simulation of a recording."""

    p: FloatArray  # (layout.SIZE,): parameters of the superset model, the recording's own among them
    start: InitialCondition  # of this simulation
    extra_load_nm: FloatArray | None = None  # (N,): load torque over time, next to the constant one
