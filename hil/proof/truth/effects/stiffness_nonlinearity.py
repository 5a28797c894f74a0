"""A shaft that hardens or softens with twist; rubber couplings do both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    scale_rad = log_uniform(rng, 0.04, 0.15)
    hardens = bool(rng.random() < 0.5)
    return {
        "hardening_twist_rad": scale_rad if hardens else 0.0,
        "softening_twist_rad": 0.0 if hardens else scale_rad,
    }


def _true_hardening(sizes: Sizes, bus: Mapping[str, float]) -> float:
    """First term of sinh(x) / x and asinh(x) / x beyond 1: x^2 / 6 with either sign."""
    if sizes["hardening_twist_rad"]:
        return 1.0 / (6.0 * sizes["hardening_twist_rad"] ** 2)
    return -1.0 / (6.0 * sizes["softening_twist_rad"] ** 2)


EFFECT = HiddenEffect(
    "stiffness_nonlinearity",
    Place.SHAFT,
    True,
    _draw,
    sets("hardening_twist_rad", "softening_twist_rad"),
    fitted={"hardening_per_rad2": _true_hardening},
)
