"""Protection that blocks both inverters for an instant again and again, unseen by their reading. No catalogue entry."""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"dropout_every_s": rng.uniform(0.7, 3.0), "dropout_s": log_uniform(rng, 0.015, 0.06)}


EFFECT = HiddenEffect("torque_dropouts", Place.TORQUE_PATH, False, _draw, sets("dropout_every_s", "dropout_s"))
