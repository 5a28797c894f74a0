"""A crack, or a joint that settles: the shaft's stiffness changes at a moment and stays changed."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.experiments import DURATION_S
from hil.proof.truth.hidden import HiddenEffect, Interval, Place, Sizes, draw_presence, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    size = log_uniform(rng, 0.006, 0.08)
    return {
        "stiffness_step": -size if rng.random() < 0.75 else size,
        "rise_s": log_uniform(rng, 0.01, 0.1),
        **draw_presence(rng),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        stiffness_step=sizes["stiffness_step"],
        stiffness_step_rise_s=sizes["rise_s"],
        stiffness_step_at_s=rng.uniform(5.0, 25.0),
    )


def _when(physics: Physics) -> Interval:
    return physics.stiffness_step_at_s, DURATION_S


EFFECT = HiddenEffect(
    "stiffness_change", Place.SHAFT, True, _draw, _apply, when=_when, fitted={"change": "stiffness_step"}
)
