"""A bent Cardan joint: the shaft behind it leads and lags twice per turn of the motor.

Each recording begins at another angle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"joint_angle_rad": log_uniform(rng, 0.08, 0.25)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(joint_angle_rad=sizes["joint_angle_rad"], joint_phase_rad=rng.uniform(0.0, np.pi))


def _true_angle(sizes: Sizes, bus: Mapping[str, float]) -> float:
    """Second harmonic of the joint's lead: the square of the tangent of half its bend."""
    return math.tan(0.5 * sizes["joint_angle_rad"]) ** 2


EFFECT = HiddenEffect("cardan_second_order", Place.SHAFT, True, _draw, _apply, fitted={"angle_rad": _true_angle})
