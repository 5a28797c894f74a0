"""A torque reading whose offset drifts away from the start on, as a current sensor warms."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, either, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"bias_nm": either(rng, log_uniform(rng, 6.0, 40.0)), "bias_half_s": rng.uniform(3.0, 15.0)}


EFFECT = HiddenEffect("torque_bias", Place.TORQUE_PATH, True, _draw, sets("bias_nm", "bias_half_s"))
