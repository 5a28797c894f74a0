"""A coarse speed: of few digits, or made of few encoder counts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    grid_rad_s = log_uniform(rng, 0.15, 1.0)
    if rng.random() < 0.5:
        return {"grid_rad_s": grid_rad_s, "count_rad": 0.0, "count_time_s": 0.0}
    count_time_s = log_uniform(rng, 0.001, 0.002)
    return {"grid_rad_s": 0.0, "count_rad": grid_rad_s * count_time_s, "count_time_s": count_time_s}


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(
        acquisition,
        grid_rad_s=sizes["grid_rad_s"],
        count_rad=sizes["count_rad"],
        count_time_s=sizes["count_time_s"],
    )


def _true_step(sizes: Sizes, bus: Mapping[str, float]) -> float:
    return sizes["grid_rad_s"] or sizes["count_rad"] / sizes["count_time_s"]


EFFECT = HiddenEffect(
    "speed_quantisation", Place.SPEED_SENSOR, True, _draw, corrupt=_corrupt, fitted={"step_rad_s": _true_step}
)
