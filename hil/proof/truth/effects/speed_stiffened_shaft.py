"""A shaft that is stiffer or softer at speed: centrifugal force in its couplings. No catalogue entry."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, either, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "stiffness_share": either(rng, log_uniform(rng, 0.03, 0.3)),
        "half_speed_rad_s": rng.uniform(20.0, 45.0),
    }


EFFECT = HiddenEffect(
    "speed_stiffened_shaft",
    Place.SHAFT,
    False,
    _draw,
    sets(stiffness_speed_share="stiffness_share", stiffness_speed_rad_s="half_speed_rad_s"),
)
