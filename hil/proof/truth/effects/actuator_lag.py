"""The current loops of both inverters are slower than the model thinks."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"current_loop_time_s": log_uniform(rng, 0.002, 0.025)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(current_loop_time_s=sizes["current_loop_time_s"])


EFFECT = HiddenEffect("actuator_lag", Place.TORQUE_PATH, True, _draw, _apply)
