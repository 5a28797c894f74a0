"""One more inertia and spring in the line: a gearbox behind the motor, or an axle before the wheels.

It comes on top of the data sheet's inertias and in series with its shaft. Its mode is between 15 and 50 Hz.
"""

from __future__ import annotations

import math

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    at_motor = bool(rng.random() < 0.5)
    inertia = bus.J_M * (log_uniform(rng, 0.12, 0.4) if at_motor else log_uniform(rng, 0.4, 2.0))
    stiffness = bus.k * log_uniform(rng, 3.0, 8.0)
    return {
        "at_motor": float(at_motor),
        "inertia_kg_m2": inertia,
        "stiffness_nm_per_rad": stiffness,
        "damping_nm_s_per_rad": 2.0 * rng.uniform(0.01, 0.05) * math.sqrt(inertia * stiffness),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        extra_at_motor=bool(sizes["at_motor"]),
        extra_inertia=sizes["inertia_kg_m2"],
        extra_stiffness=sizes["stiffness_nm_per_rad"],
        extra_damping=sizes["damping_nm_s_per_rad"],
    )


EFFECT = HiddenEffect("extra_torsional_mode", Place.SHAFT, True, _draw, _apply)
