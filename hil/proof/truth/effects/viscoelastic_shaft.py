"""A viscoelastic shaft: rubber adds branches that relax, one slow and a smaller one fast (a Prony series)."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "maxwell_stiffness_nm_per_rad": bus.k * log_uniform(rng, 0.15, 0.6),
        "maxwell_time_s": log_uniform(rng, 0.01, 0.04),
        "maxwell_fast_share": rng.uniform(0.0, 0.25),
    }


EFFECT = HiddenEffect(
    "viscoelastic_shaft",
    Place.SHAFT,
    True,
    _draw,
    sets("maxwell_time_s", "maxwell_fast_share", maxwell_stiffness="maxwell_stiffness_nm_per_rad"),
)
