"""The inverter smooths its speed: a digital filter of first or second order at its cycle of 0.1 ms."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets, unless_zero


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    time_s = log_uniform(rng, 0.0008, 0.007)
    if rng.random() < 0.5:
        return {"time_constant_s": time_s, "corner_rad_s": 0.0, "damping": 1.0}
    damping = rng.uniform(0.65, 1.0)
    return {"time_constant_s": 0.0, "corner_rad_s": 2.0 * damping / time_s, "damping": damping}


EFFECT = HiddenEffect(
    "speed_filter",
    Place.SPEED_SENSOR,
    True,
    _draw,
    sets(filter_time_s="time_constant_s", filter_rad_s="corner_rad_s", filter_damping="damping"),
    fitted={"time_constant_s": unless_zero("time_constant_s")},
)
