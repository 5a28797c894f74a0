"""A heavy or an oval wheel: torque against the load at once and twice per wheel turn.

Each recording begins at another angle.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    once_nm = log_uniform(rng, 4.0, 60.0)
    return {
        "imbalance_nm": once_nm,
        "imbalance_twice_nm": once_nm * rng.uniform(0.0, 0.3),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        imbalance_nm=sizes["imbalance_nm"],
        imbalance_twice_nm=sizes["imbalance_twice_nm"],
        imbalance_phase_rad=rng.uniform(0.0, 2.0 * np.pi),
    )


EFFECT = HiddenEffect("load_imbalance", Place.LOAD, True, _draw, _apply, fitted={"amplitude_nm": "imbalance_nm"})
