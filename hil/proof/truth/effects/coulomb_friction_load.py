"""Dry friction at the wheels, the same at every speed: dragging pads, wheel bearings, axle seals."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"coulomb_nm": log_uniform(rng, 7.0, 35.0)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(friction_load_nm=sizes["coulomb_nm"])


EFFECT = HiddenEffect("coulomb_friction_load", Place.LOAD, True, _draw, _apply)
