"""Hills: the road's height over the distance driven, as a sum of waves; gravity does the rest."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import FloatArray, Physics

WAVES = 6
SHORTEST_M, LONGEST_M = 40.0, 250.0
"""Wave lengths: shorter is roughness the tyre swallows, longer does not turn within a recording."""

ROAD_LENGTH_M = 20_000.0


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"slope_rms": log_uniform(rng, 0.003, 0.01)}


def _height_profile(slope_rms: float, rng: np.random.Generator) -> FloatArray:
    """Return waves of equal slope each, shape (WAVES, 3): height [m], wave number [rad/m], phase [rad]."""
    numbers = 2.0 * np.pi / np.exp(rng.uniform(np.log(SHORTEST_M), np.log(LONGEST_M), WAVES))
    heights = slope_rms * np.sqrt(2.0 / WAVES) / numbers
    return np.column_stack([heights, numbers, rng.uniform(0.0, 2.0 * np.pi, WAVES)])


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    road = _height_profile(sizes["slope_rms"], rng)
    return physics._replace(road=road, road_start_m=rng.uniform(0.0, ROAD_LENGTH_M))


EFFECT = HiddenEffect("road_grade", Place.LOAD, True, _draw, _apply)
