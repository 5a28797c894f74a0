"""The resolver believes in an angle that is off once (eccentricity) and twice (gain) per turn.

Each recording begins at another angle.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    once_rad = log_uniform(rng, 0.004, 0.02)
    return {
        "resolver_once_rad": once_rad,
        "resolver_twice_rad": once_rad * rng.uniform(0.2, 0.6),
        "resolver_once_phase_rad": rng.uniform(0.0, 2.0 * np.pi),
        "resolver_twice_phase_rad": rng.uniform(0.0, 2.0 * np.pi),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    start_rad = rng.uniform(0.0, 2.0 * np.pi)
    return physics._replace(
        resolver_once_rad=sizes["resolver_once_rad"],
        resolver_twice_rad=sizes["resolver_twice_rad"],
        resolver_once_phase_rad=sizes["resolver_once_phase_rad"] + start_rad,
        resolver_twice_phase_rad=sizes["resolver_twice_phase_rad"] + 2.0 * start_rad,
    )


EFFECT = HiddenEffect(
    "resolver_error",
    Place.SPEED_SENSOR,
    True,
    _draw,
    _apply,
    fitted={"once_rad": "resolver_once_rad", "twice_rad": "resolver_twice_rad"},
    unscaled=("resolver_once_phase_rad", "resolver_twice_phase_rad"),
)
