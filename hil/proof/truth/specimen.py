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
from hil.proof.truth import effects_chain, effects_line
from hil.proof.truth.bus import NOMINAL_ERROR, Bus, draw_bus, draw_nominal
from hil.proof.truth.hidden import HiddenEffect, Interval, Sizes
from hil.proof.truth.physics import Physics
from hil.proof.truth.recording import FAULTLESS, Acquisition

NOTHING = "none"

EFFECTS: Mapping[str, HiddenEffect] = {
    effect.name: effect
    for effect in (
        HiddenEffect(NOTHING, lambda rng, bus: {}),
        *effects_chain.TORQUE_PATH,
        *effects_line.MOTOR,
        *effects_line.SHAFT,
        *effects_line.LOAD,
        *effects_chain.SPEED_SENSOR,
        *effects_chain.ACQUISITION,
        *effects_line.FURTHER,
        *effects_chain.FURTHER,
        *effects_chain.OUTSIDE,
    )
}
"""Nothing; the contract's catalogue in its order; what no entry of it describes."""

PAIR_SIGN = "+"


def find(names: str) -> tuple[HiddenEffect, ...]:
    """Return the effects of a name or of several joined by ``+`` (``backlash+road_grade``)."""
    wanted = names.split(PAIR_SIGN)
    for name in wanted:
        if name not in EFFECTS:
            raise UsageError(
                f"effect {name!r}: expected one of {', '.join(EFFECTS)}, or several joined by {PAIR_SIGN!r}"
            )
    return tuple(EFFECTS[name] for name in wanted)


class Stream(IntEnum):
    """What a generator is for; the second number of its seed."""

    BUS = 1
    NOMINAL = 2
    SIZES = 3
    RECORDING = 4
    CHOICE = 5
    WORLD = 6


def stream(seed: int, purpose: Stream, *key: int) -> np.random.Generator:
    """Return the generator for one purpose of one seed."""
    if seed < 0:
        raise UsageError(f"seed: expected 0 or greater, got {seed}")
    return np.random.default_rng([seed, purpose, *key])


@dataclass(frozen=True, slots=True)
class Specimen:
    """One bus and what it hides."""

    effect: str  # name, or names joined by ``+``
    seed: int  # what everything was drawn from
    bus: Bus  # the true driveline
    nominal: Mapping[str, float]  # the six values of the nominal model
    sizes: Mapping[str, Sizes]  # by name of the effect

    @property
    def effects(self) -> tuple[HiddenEffect, ...]:
        """What is hidden, in the order of `effect`; one that changes nothing where that is ``none``."""
        return find(self.effect)

    def physics(self, rng: np.random.Generator, test: int = 0) -> Physics:
        """Return the driveline for one drive; ``rng`` draws where on the road and when an event.

        ``test`` counts the three tests from 0: an event may be missing in one of them.
        """
        physics = self.bus.physics()
        for effect in self._in(test):
            physics = effect.apply(physics, self.sizes[effect.name], rng)
        return physics

    def acquisition(self, test: int = 0) -> Acquisition:
        """Return the chain from sensor to file in one of the three tests."""
        acquisition = FAULTLESS
        for effect in self._in(test):
            acquisition = effect.corrupt(acquisition, self.sizes[effect.name])
        return acquisition

    def events(self, physics: Physics, test: int) -> dict[str, list[Interval]]:
        """Return when each event of a drive takes place; empty lists for those that don't."""
        return {
            effect.name: [effect.when(physics)] if effect in self._in(test) else []
            for effect in self.effects
            if effect.when is not None
        }

    def _in(self, test: int) -> list[HiddenEffect]:
        return [effect for effect in self.effects if effect.happens_in(test, self.sizes[effect.name])]

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


def draw_specimen(effect: str, seed: int, nominal_error: float = NOMINAL_ERROR) -> Specimen:
    """Draw a bus and hide an effect in it."""
    bus = draw_bus(stream(seed, Stream.BUS))
    sizes = {
        hidden.name: hidden.draw(stream(seed, Stream.SIZES, zlib.crc32(hidden.name.encode())), bus)
        for hidden in find(effect)
    }
    specimen = Specimen(
        effect=effect,
        seed=seed,
        bus=bus,
        nominal=draw_nominal(bus, stream(seed, Stream.NOMINAL), nominal_error),
        sizes=sizes,
    )
    _refuse_rivals(specimen)
    return specimen


def _refuse_rivals(specimen: Specimen) -> None:
    """Refuse effects that set the same thing: the last would take the place of the first."""
    setter: dict[str, str] = {}
    for effect in specimen.effects:
        for name in _what_is_set_by(effect, specimen):
            if name in setter:
                raise UsageError(
                    f"effect {specimen.effect!r}: expected effects of different physics, but {setter[name]} and "
                    f"{effect.name} both set {name}. Hide them in different buses."
                )
            setter[name] = effect.name


def _what_is_set_by(effect: HiddenEffect, specimen: Specimen) -> list[str]:
    sizes = specimen.sizes[effect.name]
    before, chain = specimen.bus.physics(), asdict(FAULTLESS)
    after = effect.apply(before, sizes, stream(specimen.seed, Stream.SIZES))
    physics = [name for name in Physics._fields if getattr(after, name) is not getattr(before, name)]
    corrupted = asdict(effect.corrupt(FAULTLESS, sizes))
    return physics + [name for name in chain if corrupted[name] != chain[name]]


def choose_effect(names: Sequence[str], seed: int) -> str:
    """Return one of the names, each as likely as any other."""
    return names[int(stream(seed, Stream.CHOICE).integers(len(names)))]
