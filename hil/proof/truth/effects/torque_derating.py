"""Both inverters give less and less of what they read as magnets and current sensors warm up.

Every recording begins cold. The loss comes exponentially, or evenly with time.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform, sets, unless_zero


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    loss = log_uniform(rng, 0.03, 0.25)
    exponential = bool(rng.random() < 0.5)
    return {"loss": loss, "time_constant_s": rng.uniform(4.0, 15.0) if exponential else 0.0}


def _true_depth(sizes: Sizes, bus: Mapping[str, float]) -> float | None:
    """Only the exponential loss has one: the even one ends nowhere."""
    return sizes["loss"] if sizes["time_constant_s"] else None


EFFECT = HiddenEffect(
    "torque_derating",
    Place.TORQUE_PATH,
    True,
    _draw,
    sets(derating="loss", derating_time_s="time_constant_s"),
    fitted={"depth": _true_depth, "time_constant_s": unless_zero("time_constant_s")},
)
