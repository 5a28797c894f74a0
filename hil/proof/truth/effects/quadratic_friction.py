"""Drag on the motor shaft that grows with the square of the speed; a fan, churned oil."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Scale, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"drag_nm_s2": log_uniform(rng, 0.02, 0.08)}


EFFECT = HiddenEffect(
    "quadratic_friction",
    Place.MOTOR,
    True,
    _draw,
    sets(quadratic_motor="drag_nm_s2"),
    fitted={"quadratic_nm_s2": "drag_nm_s2"},
    scale=Scale("Nm s^2/rad^2", 1e-3),
)
