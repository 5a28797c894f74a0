"""Free play in the line: gear teeth, splines, worn joints."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"gap_rad": log_uniform(rng, 0.004, 0.04)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(gap_rad=sizes["gap_rad"])


EFFECT = HiddenEffect("backlash", Place.SHAFT, True, _draw, _apply)
