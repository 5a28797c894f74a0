"""Free play in the line: gear teeth, splines, worn joints."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Scale, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"gap_rad": log_uniform(rng, 0.004, 0.04)}


EFFECT = HiddenEffect(
    "backlash",
    Place.SHAFT,
    True,
    _draw,
    sets("gap_rad"),
    fitted={"gap_rad": "gap_rad"},
    scale=Scale("rad", 1e-3, least=1e-9),
)
