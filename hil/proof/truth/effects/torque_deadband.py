"""Dead time of the inverters: a small torque does not come at all, a large one falls short. No catalogue entry."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"deadband_nm": log_uniform(rng, 4.0, 25.0)}


EFFECT = HiddenEffect("torque_deadband", Place.TORQUE_PATH, False, _draw, sets("deadband_nm"))
