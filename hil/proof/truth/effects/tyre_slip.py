"""Tyres that slip: only the wheels turn with the shaft, the vehicle follows through the contact patch.

The wheels' inertia is part of the load's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics
from hil.proof.truth.tyre import SHAPE


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "wheel_inertia_kg_m2": rng.uniform(1.5, 5.0),
        "slip_stiffness_nm": log_uniform(rng, 4e4, 3e5),
        "grip_nm": log_uniform(rng, 1500.0, 6000.0),
        "relaxation_m": rng.uniform(0.15, 0.5),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        wheel_inertia=sizes["wheel_inertia_kg_m2"],
        slip_stiffness_nm=sizes["slip_stiffness_nm"],
        grip_nm=sizes["grip_nm"],
        relaxation_rad=sizes["relaxation_m"] / physics.metres_per_rad,
    )


def _true_slip(sizes: Sizes, bus: Mapping[str, float]) -> float:
    return 1.0 / sizes["slip_stiffness_nm"]


def _true_share(sizes: Sizes, bus: Mapping[str, float]) -> float:
    return sizes["wheel_inertia_kg_m2"] / bus["J_L"]


def _true_relaxation(sizes: Sizes, bus: Mapping[str, float]) -> float:
    return sizes["relaxation_m"] * bus["gear_ratio"] / bus["wheel_radius_m"]


def _true_grip(sizes: Sizes, bus: Mapping[str, float]) -> float:
    """Grip of the ``G tanh(x / G)`` that levels off as ``D sin(C atan(x / (C D)))`` does: their terms in x^3 agree."""
    return sizes["grip_nm"] / math.sqrt(0.5 + SHAPE**-2)


EFFECT = HiddenEffect(
    "tyre_slip",
    Place.LOAD,
    True,
    _draw,
    _apply,
    fitted={
        "slip_per_nm": _true_slip,
        "wheel_share": _true_share,
        "relaxation_rad": _true_relaxation,
        "grip_nm": _true_grip,
    },
)
