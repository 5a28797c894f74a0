"""An inverter that changes its torque no faster than so much in a second. No catalogue entry.

Its reading is the demand.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"slew_nm_s": log_uniform(rng, 2500.0, 12000.0)}


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(slew_nm_s=sizes["slew_nm_s"])


EFFECT = HiddenEffect("torque_slew", Place.TORQUE_PATH, False, _draw, _apply)
