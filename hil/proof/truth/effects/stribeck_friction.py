"""Dry friction on the motor shaft that is higher near standstill than while sliding."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    coulomb_nm = log_uniform(rng, 8.0, 25.0)
    return {
        "coulomb_nm": coulomb_nm,
        "breakaway_nm": coulomb_nm * rng.uniform(1.8, 3.0),
        "stribeck_speed_rad_s": log_uniform(rng, 0.8, 4.0),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        friction_motor_nm=sizes["coulomb_nm"],
        breakaway_motor_nm=sizes["breakaway_nm"],
        stribeck_speed_rad_s=sizes["stribeck_speed_rad_s"],
    )


EFFECT = HiddenEffect("stribeck_friction", Place.MOTOR, True, _draw, _apply)
