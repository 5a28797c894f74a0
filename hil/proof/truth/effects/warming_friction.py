"""Axle oil that is thick when cold: viscous friction falls to the data sheet's as it warms.

Every recording begins cold.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"cold_factor": 1.0 + log_uniform(rng, 0.12, 1.5), "warming_time_s": log_uniform(rng, 4.0, 15.0)}


EFFECT = HiddenEffect("warming_friction", Place.LOAD, True, _draw, sets("cold_factor", "warming_time_s"))
