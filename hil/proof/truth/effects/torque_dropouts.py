"""Protection that blocks both inverters for an instant again and again, unseen by their reading. No catalogue entry."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"dropout_every_s": rng.uniform(0.7, 3.0), "dropout_s": log_uniform(rng, 0.015, 0.06)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(dropout_every_s=sizes["dropout_every_s"], dropout_s=sizes["dropout_s"])


EFFECT = HiddenEffect("torque_dropouts", Place.TORQUE_PATH, False, _draw, _apply)
