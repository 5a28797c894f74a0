"""Dry friction on the motor shaft, the same at every speed; bearings, seals, an oil pump's preload."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"coulomb_nm": log_uniform(rng, 8.0, 40.0)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(friction_motor_nm=sizes["coulomb_nm"])


EFFECT = HiddenEffect("coulomb_friction_motor", Place.MOTOR, True, _draw, _apply)
