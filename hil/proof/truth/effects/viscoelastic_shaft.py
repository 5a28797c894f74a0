"""A viscoelastic shaft: rubber adds branches that relax, one slow and a smaller one fast (a Prony series)."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "maxwell_stiffness_nm_per_rad": bus.k * log_uniform(rng, 0.15, 0.6),
        "maxwell_time_s": log_uniform(rng, 0.01, 0.04),
        "maxwell_fast_share": rng.uniform(0.0, 0.25),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        maxwell_stiffness=sizes["maxwell_stiffness_nm_per_rad"],
        maxwell_time_s=sizes["maxwell_time_s"],
        maxwell_fast_share=sizes["maxwell_fast_share"],
    )


EFFECT = HiddenEffect("viscoelastic_shaft", Place.SHAFT, True, _draw, _apply)
