"""The payload changes under way: sand or water runs out, or comes from a vehicle alongside.

What leaves or comes has the bus's speed, so the speed continues without a step and only the acceleration changes. The
constant load torque stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.experiments import DURATION_S
from hil.proof.truth.hidden import HiddenEffect, Interval, Place, Sizes, draw_presence, either, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "payload_share": either(rng, log_uniform(rng, 0.06, 0.25)),
        "rise_s": log_uniform(rng, 0.1, 1.0),
        **draw_presence(rng),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    return physics._replace(
        payload_share=sizes["payload_share"], payload_rise_s=sizes["rise_s"], payload_at_s=rng.uniform(6.0, 22.0)
    )


def _when(physics: Physics) -> Interval:
    return physics.payload_at_s, DURATION_S


def _true_change(sizes: Sizes, bus: Mapping[str, float]) -> float:
    return sizes["payload_share"] * bus["J_L"]


EFFECT = HiddenEffect(
    "inertia_change", Place.LOAD, True, _draw, _apply, when=_when, fitted={"change_kg_m2": _true_change}
)
