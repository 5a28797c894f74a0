"""A torque reading whose offset drifts away from the start on, as a current sensor warms."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, either, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"bias_nm": either(rng, log_uniform(rng, 6.0, 40.0)), "bias_half_s": rng.uniform(3.0, 15.0)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(bias_nm=sizes["bias_nm"], bias_half_s=sizes["bias_half_s"])


EFFECT = HiddenEffect("torque_bias", Place.TORQUE_PATH, True, _draw, _apply)
