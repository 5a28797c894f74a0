"""A bus as buses are: several small imperfections at once, disturbances with a colour, and perhaps one strong effect.

The imperfections are effects of the catalogue at a fraction of the sizes at which they are concealed by themselves;
which ones, how many and how small is drawn. What the nominal model knows of them is drawn by the caller.
"""

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum

import numpy as np

from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.case import TESTS, Case, record
from hil.proof.truth.hidden import HiddenEffect, Sizes, log_uniform
from hil.proof.truth.recording import Noise
from hil.proof.truth.specimen import EFFECTS, PAIR_SIGN, Stream, draw_specimen, stream

IMPERFECTIONS = (
    "coulomb_friction_motor",
    "coulomb_friction_load",
    "aerodynamic_drag",
    "quadratic_friction",
    "actuator_lag",
    "transport_delay",
    "torque_ripple",
    "load_imbalance",
    "resolver_error",
    "shaft_hysteresis",
    "cardan_second_order",
)
"""What every vehicle has a little of. The bus of a seed is drawn from them in this order: another list makes others."""

UNSCALED = {
    "torque_ripple": ("order",),
    "resolver_error": ("resolver_once_phase_rad", "resolver_twice_phase_rad"),
    "shaft_hysteresis": ("slip_rad",),
}
"""Sizes that stay as they are where an effect is made smaller."""

FEWEST, MOST = 3, 6
LEAST_PART, MOST_PART = 0.05, 0.35
"""Part of the size at which an imperfection would be concealed by itself."""


class Known(Enum):
    """What the nominal model says of the imperfections."""

    NONE = "none"
    EXACT = "exact"
    OFF = "off"


def make_dirty(strong: str, seed: int, known: Known = Known.NONE) -> tuple[Case, dict[str, dict[str, float]]]:
    """Draw a dirty bus with one strong effect, record it, and say what its model file knows beyond the line."""
    rng = stream(seed, Stream.WORLD)
    names, sizes = _small(strong, seed, rng)
    drawn = draw_specimen(strong, seed)
    specimen = replace(drawn, effect=PAIR_SIGN.join([strong, *names]), sizes={**drawn.sizes, **sizes})
    noise = _noise(rng)
    recordings = tuple(record(specimen, number, noise) for number in range(2 * len(TESTS)))
    case = Case(specimen, recordings[: len(TESTS)], recordings[len(TESTS) :])
    return case, _stated(sizes, known, rng)


def _small(strong: str, seed: int, rng: np.random.Generator) -> tuple[list[str], dict[str, Sizes]]:
    """Draw imperfections of other physics than the strong effect's, each small."""
    taken = {field for name in strong.split(PAIR_SIGN) for field in _fields(name, seed)}
    names: list[str] = []
    sizes: dict[str, Sizes] = {}
    count = int(rng.integers(FEWEST, MOST + 1))
    for name in rng.permutation(IMPERFECTIONS).tolist():
        fields = _fields(name, seed)
        if len(names) < count and not fields & taken:
            whole = draw_specimen(name, seed).sizes[name]
            part = log_uniform(rng, LEAST_PART, MOST_PART)
            sizes[name] = {**whole, **{key: part * whole[key] for key in strength_of(name, whole)}}
            names.append(name)
            taken |= fields
    return names, sizes


def strength_of(name: str, sizes: Sizes) -> list[str]:
    """Return which of an effect's sizes say how much of it there is."""
    return [size for size in sizes if size not in UNSCALED.get(name, ())]


def _fields(name: str, seed: int) -> set[str]:
    """Return the fields of the physics that an effect sets."""
    specimen = draw_specimen(name, seed)
    before = specimen.bus.physics()
    after = before
    for effect in specimen.effects:
        after = effect.apply(after, specimen.sizes[effect.name], stream(seed, Stream.WORLD))
    return {field for field in before._fields if getattr(after, field) is not getattr(before, field)}


def _noise(rng: np.random.Generator) -> Noise:
    """Draw sensors: half of the speed's noise coloured, and torque readings that drift."""
    return Noise(
        speed_rad_s=rng.uniform(0.02, 0.05),
        coloured_rad_s=rng.uniform(0.01, 0.05),
        coloured_hz=log_uniform(rng, 1.0, 15.0),
        torque_drift_nm=log_uniform(rng, 0.2, 1.0),
        torque_drift_hz=log_uniform(rng, 0.02, 0.2),
    )


def _stated(sizes: Mapping[str, Sizes], known: Known, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    if known is Known.NONE:
        return {}
    error = NOMINAL_ERROR if known is Known.OFF else 0.0
    return {
        name: {word: mine[size] * (1.0 + float(rng.uniform(-error, error))) for word, size in words.items()}
        for name, mine in sizes.items()
        if (words := in_a_model_file(EFFECTS[name], mine))
    }


def in_a_model_file(effect: HiddenEffect, sizes: Sizes) -> dict[str, str]:
    """Return words of a model file to the sizes that they state; empty where some of the effect's strength has none."""
    strength = strength_of(effect.name, sizes)
    words = {word: size for word, size in effect.fitted.items() if isinstance(size, str) and size in strength}
    return words if set(words.values()) == set(strength) else {}
