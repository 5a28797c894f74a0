"""An inverter that changes its torque no faster than so much in a second. No catalogue entry.

Its reading is the demand.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"slew_nm_s": log_uniform(rng, 2500.0, 12000.0)}


EFFECT = HiddenEffect("torque_slew", Place.TORQUE_PATH, False, _draw, sets("slew_nm_s"))
