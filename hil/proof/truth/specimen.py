"""A specimen: one bus, its nominal model, and what is hidden in it with its sizes.

Everything follows from the effect's name and one seed. Each part draws from a stream of its own, so the same
seed gives the same bus whatever is hidden in it.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import IntEnum

import numpy as np

from hil.errors import UsageError
from hil.proof.truth.bus import Bus, draw_bus, draw_nominal
from hil.proof.truth.hidden import HiddenEffect, Sizes
from hil.proof.truth.physics import Physics
from hil.proof.truth.registry import find


class Stream(IntEnum):
    """What a generator is for; the second number of its seed."""

    BUS = 1
    NOMINAL = 2
    SIZES = 3
    RECORDING = 4
    CHOICE = 5


def stream(seed: int, purpose: Stream, *key: int) -> np.random.Generator:
    """Return the generator for one purpose of one seed.

    Raises
    ------
    UsageError
        If the seed is negative.
    """
    if seed < 0:
        raise UsageError(f"seed: expected 0 or greater, came {seed}")
    return np.random.default_rng([seed, purpose, *key])


@dataclass(frozen=True, slots=True)
class Specimen:
    """One bus and what it hides.

    Attributes
    ----------
    effect : str
        Name, or names joined by ``+``.
    seed : int
        What everything was drawn from.
    bus : Bus
        The true driveline.
    nominal : mapping
        The six values of the nominal model.
    sizes : mapping of effect name to its drawn sizes
    """

    effect: str
    seed: int
    bus: Bus
    nominal: Mapping[str, float]
    sizes: Mapping[str, Sizes]

    @property
    def effects(self) -> tuple[HiddenEffect, ...]:
        """The hidden effects."""
        return find(self.effect)

    def physics(self, rng: np.random.Generator) -> Physics:
        """Return the driveline for one drive; ``rng`` draws where on the road and when an event."""
        physics = self.bus.physics()
        for effect in self.effects:
            physics = effect.apply(physics, self.sizes[effect.name], rng)
        return physics

    def truth(self) -> dict[str, object]:
        """Return what is sealed: JSON types only."""
        return {
            "effect": self.effect,
            "seed": self.seed,
            "catalogued": all(effect.catalogued for effect in self.effects),
            "element": [effect.place.value for effect in self.effects],
            "true": asdict(self.bus),
            "nominal": dict(self.nominal),
            "hidden": {name: dict(sizes) for name, sizes in self.sizes.items()},
        }


def draw_specimen(effect: str, seed: int) -> Specimen:
    """Draw a bus and hide an effect in it.

    Raises
    ------
    UsageError
        If the effect is not registered, or the seed is negative.
    """
    bus = draw_bus(stream(seed, Stream.BUS))
    return Specimen(
        effect=effect,
        seed=seed,
        bus=bus,
        nominal=draw_nominal(bus, stream(seed, Stream.NOMINAL)),
        sizes={hidden.name: hidden.draw(_size_stream(seed, hidden), bus) for hidden in find(effect)},
    )


def choose_effect(names: Sequence[str], seed: int) -> str:
    """Return one of the names, each as likely as any other."""
    return names[int(stream(seed, Stream.CHOICE).integers(len(names)))]


def _size_stream(seed: int, effect: HiddenEffect) -> np.random.Generator:
    return stream(seed, Stream.SIZES, zlib.crc32(effect.name.encode()))
