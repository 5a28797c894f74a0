"""A washboard road: short waves whose length is no wheel turn. No catalogue entry.

Too fast for a grade, and no whole number of waves meets a turn of wheel or motor.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics

WAVE_M = (3.6, 5.4)
"""Between one and two turns of a wheel of 0.48 m, and away from both."""


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"wave_m": rng.uniform(*WAVE_M), "load_torque_nm": log_uniform(rng, 10.0, 80.0)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    number = 2.0 * np.pi / sizes["wave_m"]
    height = sizes["load_torque_nm"] / physics.gravity_nm / number
    wave = np.array([[height, number, rng.uniform(0.0, 2.0 * np.pi)]])
    return physics._replace(road=np.concatenate([physics.road, wave]))


EFFECT = HiddenEffect("corrugated_road", Place.LOAD, False, _draw, _apply)
