"""Voltage or temperature limits the torque, and the reading, a model inside the inverter, continues.

Of one inverter, of both, or of their sum; in a knee rather than at an edge.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets, unless_zero

LIMITS_NM = {("m1",): (180.0, 310.0), ("m2",): (130.0, 220.0), ("m1", "m2"): (150.0, 280.0), ("sum",): (300.0, 480.0)}
"""What is limited, and to what: where the strongest of the three tests asks for somewhat more."""


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    what = list(LIMITS_NM)[rng.integers(len(LIMITS_NM))]
    limit_nm = log_uniform(rng, *LIMITS_NM[what])
    return {
        "limit_m1_nm": limit_nm if "m1" in what else 0.0,
        "limit_m2_nm": limit_nm if "m2" in what else 0.0,
        "limit_total_nm": limit_nm if "sum" in what else 0.0,
        "knee": log_uniform(rng, 6.0, 20.0),
    }


EFFECT = HiddenEffect(
    "torque_saturation",
    Place.TORQUE_PATH,
    True,
    _draw,
    sets("limit_m1_nm", "limit_m2_nm", "limit_total_nm", limit_knee="knee"),
    fitted={
        "limit_m1_nm": unless_zero("limit_m1_nm"),
        "limit_m2_nm": unless_zero("limit_m2_nm"),
        "limit_sum_nm": unless_zero("limit_total_nm"),
    },
)
