"""What a hidden effect is: name, place, the draw of its sizes, what it changes, and what a fit of it should find."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.physics import Physics
from hil.proof.truth.recording import Acquisition

Sizes = Mapping[str, float]
"""Drawn sizes of an effect; named as the fields of `Physics` where one size sets one field."""

Draw = Callable[[np.random.Generator, Bus], Sizes]
Apply = Callable[[Physics, Sizes, np.random.Generator], Physics]
Corrupt = Callable[[Acquisition, Sizes], Acquisition]
Interval = tuple[float, float]
When = Callable[[Physics], Interval]

Convert = Callable[[Sizes, Mapping[str, float]], float | None]
"""Sizes and true bus to the value that a fitted parameter should have; None where this draw has none."""

ABSENT_IN = "absent_in"  # size that says in which of the three tests (0, 1, 2) an event does not take place
ONLY_IN = "only_in"  # size that says in which of the three tests alone it does


def same_physics(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    """Leave the physics as they are: for what happens to a recording alone."""
    return physics


def same_recording(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    """Leave the recording as it is: for what happens in the driveline."""
    return acquisition


class ConcealedAt(Enum):
    """The element an effect belongs to (CONTRACT); ``NOWHERE`` where nothing is hidden."""

    TORQUE_PATH = "torque_path"
    MOTOR = "motor"
    SHAFT = "shaft"
    LOAD = "load"
    SPEED_SENSOR = "speed_sensor"
    ACQUISITION = "acquisition"
    NOWHERE = "nowhere"


@dataclass(frozen=True, slots=True)
class HiddenEffect:
    """One effect that can be concealed in a bus."""

    name: str  # as in the contract's catalogue, or a name of its own outside it
    draw: Draw  # generator and bus to sizes
    apply: Apply = same_physics  # physics, sizes and generator to the physics with the effect
    corrupt: Corrupt = same_recording  # acquisition and sizes to the acquisition with the effect
    when: When | None = None  # from when to when an event lasts [s]; None for what is no event
    # by parameter of the catalogue's effect: the size it should be, or what makes it
    fitted: Mapping[str, str | Convert] = field(default_factory=dict)
    place: ConcealedAt = ConcealedAt.NOWHERE  # the element it belongs to
    catalogued: bool = True  # false for what no entry of the contract's catalogue describes

    def happens_in(self, test: int, sizes: Sizes) -> bool:
        """Say whether the effect takes place in one of the three tests, counted from 0."""
        return test == sizes.get(ONLY_IN, test) and test != sizes.get(ABSENT_IN)

    def should_be(self, parameter: str, sizes: Sizes, bus: Mapping[str, float]) -> float | None:
        """Return the value that a parameter of `fitted` should have; None where this draw has none."""
        how = self.fitted[parameter]
        return sizes[how] if isinstance(how, str) else how(sizes, bus)


def sets(*fields: str, **renamed: str) -> Apply:
    """Return the change that sets fields of the physics to the sizes of their names, or of another name each."""
    size_of = {**dict(zip(fields, fields, strict=True)), **renamed}

    def apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
        values: dict[str, Any] = {name: type(getattr(physics, name))(sizes[size]) for name, size in size_of.items()}
        return physics._replace(**values)

    return apply


def then(apply: Apply, name: str, low: float, high: float) -> Apply:
    """Return a change after which one more field is drawn for each recording: a phase, or the moment of an event."""

    def applied(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
        value: dict[str, Any] = {name: rng.uniform(low, high)}
        return apply(physics, sizes, rng)._replace(**value)

    return applied


def corrupts(*fields: str, **renamed: str) -> Corrupt:
    """Return the fault of the acquisition that sets fields to the sizes of their names, or of another name each."""
    size_of = {**dict(zip(fields, fields, strict=True)), **renamed}

    def corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
        values = {name: type(getattr(acquisition, name))(sizes[size]) for name, size in size_of.items()}
        return replace(acquisition, **values)

    return corrupt


def unless_zero(size: str) -> Convert:
    """Return the conversion of a size that is 0 where another variant of the effect was drawn."""
    return lambda sizes, bus: sizes[size] or None


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a size so that every factor between moderate and well visible is as likely as any other."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def log(low: float, high: float) -> Callable[[np.random.Generator], float]:
    """Return the draw of a positive size, log-uniform between two ends."""
    return lambda rng: log_uniform(rng, low, high)


def uniform(low: float, high: float) -> Callable[[np.random.Generator], float]:
    """Return the draw of a size, uniform between two ends."""
    return lambda rng: rng.uniform(low, high)


def signed(low: float, high: float) -> Callable[[np.random.Generator], float]:
    """Return the draw of a size of either sign."""
    return lambda rng: either(rng, log_uniform(rng, low, high))


def draws(**sizes: Callable[[np.random.Generator], float]) -> Draw:
    """Return the draw of sizes that do not depend on each other."""
    return lambda rng, bus: {name: draw(rng) for name, draw in sizes.items()}


def draw_absence(rng: np.random.Generator) -> Sizes:
    """Draw whether an event is in every test or, one time in three, missing in one of them."""
    return {ABSENT_IN: float(rng.integers(3))} if rng.random() < 1 / 3 else {}


def draw_presence(rng: np.random.Generator) -> Sizes:
    """Draw whether a lasting change is in every test, missing in one, or in one alone; each as likely."""
    return [{}, {ABSENT_IN: float(rng.integers(3))}, {ONLY_IN: float(rng.integers(3))}][rng.integers(3)]


def either(rng: np.random.Generator, size: float) -> float:
    """Give a size one of both signs."""
    return size if rng.random() < 0.5 else -size
