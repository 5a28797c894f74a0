"""A bus as buses are: several small imperfections at once, disturbances with a colour, and perhaps one strong effect.

The imperfections are effects of the catalogue at a fraction of the sizes at which they are concealed by themselves;
which ones, how many and how small is drawn. What the nominal model knows of them is drawn by the caller.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum

import numpy as np

from hil.proof.truth.bus import NOMINAL_ERROR
from hil.proof.truth.case import TESTS, Case, record
from hil.proof.truth.hidden import Sizes, log_uniform
from hil.proof.truth.registry import PAIR_SIGN
from hil.proof.truth.sensors import Noise
from hil.proof.truth.specimen import Stream, draw_specimen, stream

SMALL: Mapping[str, tuple[str, ...]] = {
    "coulomb_friction_motor": ("coulomb_nm",),
    "coulomb_friction_load": ("coulomb_nm",),
    "aerodynamic_drag": ("drag_nm_s2",),
    "quadratic_friction": ("drag_nm_s2",),
    "actuator_lag": ("current_loop_time_s",),
    "transport_delay": ("delay_s",),
    "torque_ripple": ("ripple_nm", "ripple_over_torque"),
    "load_imbalance": ("imbalance_nm", "imbalance_twice_nm"),
    "resolver_error": ("resolver_once_rad", "resolver_twice_rad"),
    "shaft_hysteresis": ("sliding_share",),
    "cardan_second_order": ("joint_angle_rad",),
}
"""Effects that every vehicle has a little of, and the sizes that say how much."""

FEWEST, MOST = 3, 6
LEAST_PART, MOST_PART = 0.05, 0.35
"""Part of the size at which an imperfection would be concealed by itself."""


class Known(Enum):
    """What the nominal model says of the imperfections."""

    NONE = "none"
    EXACT = "exact"
    OFF = "off"


KNOWN_AS: Mapping[tuple[str, str], str] = {
    ("coulomb_friction_motor", "coulomb_nm"): "friction_nm",
    ("coulomb_friction_load", "coulomb_nm"): "friction_nm",
    ("aerodynamic_drag", "drag_nm_s2"): "drag_nm_s2",
    ("quadratic_friction", "drag_nm_s2"): "quadratic_nm_s2",
    ("actuator_lag", "current_loop_time_s"): "time_constant_s",
    ("transport_delay", "delay_s"): "delay_s",
    ("resolver_error", "resolver_once_rad"): "once_rad",
    ("resolver_error", "resolver_twice_rad"): "twice_rad",
}
"""Sizes that a model file can state in the same words; imperfections without any stay unknown."""


def make_dirty(strong: str, seed: int, known: Known = Known.NONE) -> tuple[Case, dict[str, dict[str, float]]]:
    """Draw a dirty bus with one strong effect, record it, and say what its model file knows beyond the line.

    Parameters
    ----------
    strong : str
        Name of an effect at its usual size; ``none`` for nothing strong.

    Returns
    -------
    Case
    dict of effect to sizes
        As a model file states them; off by up to `NOMINAL_ERROR` where ``known`` says so.
    """
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
    for name in rng.permutation(list(SMALL)).tolist():
        fields = _fields(name, seed)
        if len(names) < count and not fields & taken:
            whole = draw_specimen(name, seed).sizes[name]
            part = log_uniform(rng, LEAST_PART, MOST_PART)
            sizes[name] = {key: value * (part if key in SMALL[name] else 1.0) for key, value in whole.items()}
            names.append(name)
            taken |= fields
    return names, sizes


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
    stated: dict[str, dict[str, float]] = {}
    for name, mine in sizes.items():
        for key, value in mine.items():
            if (name, key) in KNOWN_AS:
                off = 1.0 + float(rng.uniform(-error, error))
                stated.setdefault(name, {})[KNOWN_AS[name, key]] = value * off
    return stated
