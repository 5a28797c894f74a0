"""Air drag of the vehicle, grown by the square of the speed (and of a head wind or a roof load)."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"drag_nm_s2": log_uniform(rng, 0.02, 0.08)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(quadratic_load=sizes["drag_nm_s2"])


EFFECT = HiddenEffect("aerodynamic_drag", Place.LOAD, True, _draw, _apply)
