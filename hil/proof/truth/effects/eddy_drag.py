"""A shorted turn in the motor: eddy-current drag that is greatest at one speed.

Currents keep to the surface at speed, which makes the law nonlinear (Davies, 1963).
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "eddy_nm": log_uniform(rng, 10.0, 60.0),
        "eddy_speed_rad_s": log_uniform(rng, 8.0, 25.0),
        "eddy_exponent": rng.uniform(0.88, 1.0),
    }


EFFECT = HiddenEffect(
    "eddy_drag",
    Place.MOTOR,
    True,
    _draw,
    sets("eddy_nm", "eddy_speed_rad_s", "eddy_exponent"),
    fitted={"peak_nm": "eddy_nm", "peak_rad_s": "eddy_speed_rad_s"},
)
