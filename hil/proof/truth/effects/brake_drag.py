"""A brake that drags for some seconds in the middle of a recording."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Interval, Place, Sizes, draw_absence, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"brake_nm": log_uniform(rng, 30.0, 120.0), **draw_absence(rng)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    from_s = rng.uniform(5.0, 15.0)
    return physics._replace(brake_nm=sizes["brake_nm"], brake_from_s=from_s, brake_to_s=from_s + rng.uniform(5.0, 12.0))


def _when(physics: Physics) -> Interval:
    return physics.brake_from_s, physics.brake_to_s


EFFECT = HiddenEffect("brake_drag", Place.LOAD, True, _draw, _apply, when=_when, fitted={"brake_nm": "brake_nm"})
