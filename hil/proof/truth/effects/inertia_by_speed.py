"""Oil that the rotor draws along the faster it turns: more inertia at speed. No catalogue entry."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"drawn_share": log_uniform(rng, 0.08, 0.3), "drawn_half_rad_s": rng.uniform(10.0, 30.0)}


EFFECT = HiddenEffect("inertia_by_speed", Place.MOTOR, False, _draw, sets("drawn_share", "drawn_half_rad_s"))
