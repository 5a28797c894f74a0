"""What a hidden effect is: name, place, the draw of its sizes, and what it changes in the physics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.physics import Physics

Sizes = Mapping[str, float]
"""Drawn sizes of an effect; named as the fields of `Physics` where one size sets one field."""

Draw = Callable[[np.random.Generator, Bus], Sizes]
Apply = Callable[[Physics, Sizes, np.random.Generator], Physics]


class Place(Enum):
    """The element an effect belongs to (CONTRACT); ``NOWHERE`` where nothing is hidden."""

    TORQUE_PATH = "torque_path"
    MOTOR = "motor"
    SHAFT = "shaft"
    LOAD = "load"
    SPEED_SENSOR = "speed_sensor"
    NOWHERE = "nowhere"


@dataclass(frozen=True, slots=True)
class HiddenEffect:
    """One effect that can be concealed in a bus.

    Attributes
    ----------
    name : str
        As in the contract's catalogue, or a name of its own outside it.
    place : Place
        The element it belongs to.
    catalogued : bool
        False for what no entry of the contract's catalogue describes: a tool can only abstain.
    draw : callable
        Generator and bus to sizes; they hold for all recordings of the bus.
    apply : callable
        Physics, sizes and the generator of one recording (start on the road, time of an event) to the physics
        with the effect.
    """

    name: str
    place: Place
    catalogued: bool
    draw: Draw
    apply: Apply


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a size so that every factor between moderate and well visible is as likely as any other."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
