"""The torque comes a fixed time after its reading; any fraction of a sample."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"delay_s": log_uniform(rng, 0.002, 0.04)}


EFFECT = HiddenEffect("transport_delay", Place.TORQUE_PATH, True, _draw, sets("delay_s"), fitted={"delay_s": "delay_s"})
