"""Dead time of the inverters: a small torque does not come at all, a large one falls short. No catalogue entry."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"deadband_nm": log_uniform(rng, 4.0, 25.0)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(deadband_nm=sizes["deadband_nm"])


EFFECT = HiddenEffect("torque_deadband", Place.TORQUE_PATH, False, _draw, _apply)
