"""Both inverters give less and less of what they read as magnets and current sensors warm up.

Every recording begins cold. The loss comes exponentially, or evenly with time.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    loss = log_uniform(rng, 0.03, 0.25)
    exponential = bool(rng.random() < 0.5)
    return {"loss": loss, "time_constant_s": rng.uniform(4.0, 15.0) if exponential else 0.0}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(derating=sizes["loss"], derating_time_s=sizes["time_constant_s"])


EFFECT = HiddenEffect("torque_derating", Place.TORQUE_PATH, True, _draw, _apply)
