"""Friction that is not the same forward and backward: a helical gear that runs up against its seal.

Its dry part differs as well as its viscous one.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, either, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    more = either(rng, log_uniform(rng, 0.15, 1.0))
    return {"viscous_forward_nm_s": more, "dry_forward_nm": 5.0 * more}


EFFECT = HiddenEffect(
    "asymmetric_friction",
    Place.MOTOR,
    True,
    _draw,
    sets("dry_forward_nm", viscous_forward="viscous_forward_nm_s"),
    fitted={"difference_nm_s": "viscous_forward_nm_s"},
)
