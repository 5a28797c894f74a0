"""A viscoelastic shaft: rubber adds a second branch, a spring in series with a damper. No catalogue entry."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "maxwell_stiffness_nm_per_rad": bus.k * log_uniform(rng, 0.15, 0.6),
        "maxwell_time_s": log_uniform(rng, 0.01, 0.04),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        maxwell_stiffness=sizes["maxwell_stiffness_nm_per_rad"], maxwell_time_s=sizes["maxwell_time_s"]
    )


EFFECT = HiddenEffect("maxwell_shaft", Place.SHAFT, False, _draw, _apply)
