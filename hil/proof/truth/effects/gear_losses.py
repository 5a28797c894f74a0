"""Gears that lose a share of the power they transmit, and more of it when the load drives them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    efficiency = 1.0 - log_uniform(rng, 0.03, 0.12)
    return {"efficiency": efficiency, "efficiency_back": 1.0 - (1.0 - efficiency) * rng.uniform(1.0, 1.8)}


def _true_loss(sizes: Sizes, bus: Mapping[str, float]) -> float:
    return 1.0 - sizes["efficiency"]


EFFECT = HiddenEffect(
    "gear_losses", Place.SHAFT, True, _draw, sets("efficiency", "efficiency_back"), fitted={"driving_share": _true_loss}
)
