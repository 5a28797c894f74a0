"""The true torque of one inverter is not what it reads: current sensor, magnet temperature."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Scale, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    size = log_uniform(rng, 0.05, 0.15)
    return {"gain_m1": 1.0 + size if rng.random() < 0.5 else 1.0 - size}


EFFECT = HiddenEffect(
    "inverter_gain_mismatch",
    Place.TORQUE_PATH,
    True,
    _draw,
    sets("gain_m1"),
    fitted={"gain_m1": "gain_m1"},
    scale=Scale("1", 0.01, absent=1.0),
)
