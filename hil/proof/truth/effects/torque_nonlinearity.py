"""The machine saturates: its torque grows less than the current from which the reading is made.

Of one sign more than of the other, or of both alike.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    positive = log_uniform(rng, 400.0, 1500.0)
    negative = positive if rng.random() < 0.5 else positive * rng.uniform(1.0, 3.0)
    return {"saturating_nm": positive, "saturating_back_nm": negative}


EFFECT = HiddenEffect(
    "torque_nonlinearity", Place.TORQUE_PATH, True, _draw, sets("saturating_nm", "saturating_back_nm")
)
