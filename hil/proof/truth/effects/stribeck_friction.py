"""Dry friction on the motor shaft that is higher near standstill than while sliding."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    coulomb_nm = log_uniform(rng, 8.0, 25.0)
    return {
        "coulomb_nm": coulomb_nm,
        "breakaway_nm": coulomb_nm * rng.uniform(1.8, 3.0),
        "stribeck_speed_rad_s": log_uniform(rng, 0.8, 4.0),
    }


def _true_excess(sizes: Sizes, bus: Mapping[str, float]) -> float:
    return sizes["breakaway_nm"] - sizes["coulomb_nm"]


EFFECT = HiddenEffect(
    "stribeck_friction",
    Place.MOTOR,
    True,
    _draw,
    sets("stribeck_speed_rad_s", friction_motor_nm="coulomb_nm", breakaway_motor_nm="breakaway_nm"),
    fitted={"coulomb_nm": "coulomb_nm", "excess_nm": _true_excess, "stribeck_rad_s": "stribeck_speed_rad_s"},
)
