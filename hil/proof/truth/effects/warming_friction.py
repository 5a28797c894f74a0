"""Axle oil that is thick when cold: viscous friction falls to the data sheet's as it warms.

Every recording begins cold.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"cold_factor": 1.0 + log_uniform(rng, 0.12, 1.5), "warming_time_s": log_uniform(rng, 4.0, 15.0)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(cold_factor=sizes["cold_factor"], warming_time_s=sizes["warming_time_s"])


EFFECT = HiddenEffect("warming_friction", Place.LOAD, True, _draw, _apply)
