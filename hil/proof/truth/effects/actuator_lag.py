"""The current loops of both inverters are slower than the model thinks."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Scale, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"current_loop_time_s": log_uniform(rng, 0.002, 0.025)}


EFFECT = HiddenEffect(
    "actuator_lag",
    Place.TORQUE_PATH,
    True,
    _draw,
    sets("current_loop_time_s"),
    fitted={"time_constant_s": "current_loop_time_s"},
    scale=Scale("s", 1e-3),
)
