"""The true torque of one inverter is not what it reads: current sensor, magnet temperature."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    size = log_uniform(rng, 0.05, 0.15)
    return {"gain_m1": 1.0 + size if rng.random() < 0.5 else 1.0 - size}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(gain_m1=sizes["gain_m1"])


EFFECT = HiddenEffect("inverter_gain_mismatch", Place.TORQUE_PATH, True, _draw, _apply)
