"""The torque comes a fixed time after its reading; any fraction of a sample."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"delay_s": log_uniform(rng, 0.002, 0.04)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(delay_s=sizes["delay_s"])


EFFECT = HiddenEffect("transport_delay", Place.TORQUE_PATH, True, _draw, _apply)
