"""A shaft that hardens or softens with twist; rubber couplings do both."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    scale_rad = log_uniform(rng, 0.04, 0.15)
    hardens = bool(rng.random() < 0.5)
    return {
        "hardening_twist_rad": scale_rad if hardens else 0.0,
        "softening_twist_rad": 0.0 if hardens else scale_rad,
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        hardening_twist_rad=sizes["hardening_twist_rad"], softening_twist_rad=sizes["softening_twist_rad"]
    )


EFFECT = HiddenEffect("stiffness_nonlinearity", Place.SHAFT, True, _draw, _apply)
