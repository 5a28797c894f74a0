"""Dry friction inside the shaft: splines, layered couplings. Part of the stiffness slides away with the twist."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.iwan import ELEMENTS
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "sliding_share": log_uniform(rng, 0.04, 0.25),
        "slip_rad": log_uniform(rng, 0.01, 0.06),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    sliding = sizes["sliding_share"] * physics.k
    return physics._replace(k=physics.k - sliding, hysteresis_stiffness=sliding, hysteresis_slip_rad=sizes["slip_rad"])


def _true_friction(sizes: Sizes, bus: Mapping[str, float]) -> float:
    """Torque with all elements sliding: their limits are evenly spaced up to ``slip_rad``."""
    mean_limit = sizes["slip_rad"] * (ELEMENTS + 1) / (2 * ELEMENTS)
    return sizes["sliding_share"] * bus["k"] * mean_limit


EFFECT = HiddenEffect(
    "shaft_hysteresis", Place.SHAFT, True, _draw, _apply, fitted={"friction_nm": _true_friction}, unscaled=("slip_rad",)
)
