"""The generator's clutch closes for some seconds: one more inertia on the motor shaft.

The generator runs nearly at the motor's speed beforehand; the closing clutch slips until both are one.
"""

from __future__ import annotations

import numpy as np

from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Interval, Place, Sizes, draw_absence, log_uniform
from hil.proof.truth.physics import Physics


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {
        "inertia_kg_m2": bus.J_M * log_uniform(rng, 0.008, 0.12),
        "lag_before": rng.uniform(0.0, 0.1),
        "clutch_nm": rng.uniform(300.0, 600.0),
        "clutch_rise_s": rng.uniform(0.1, 0.3),
        **draw_absence(rng),
    }


def _apply(physics: Physics, sizes: Sizes, rng: np.random.Generator) -> Physics:
    from_s = rng.uniform(4.0, 15.0)
    return physics._replace(
        generator_inertia=sizes["inertia_kg_m2"],
        generator_lag=sizes["lag_before"],
        clutch_nm=sizes["clutch_nm"],
        clutch_rise_s=sizes["clutch_rise_s"],
        clutch_from_s=from_s,
        clutch_to_s=from_s + rng.uniform(5.0, 13.0),
    )


def _when(physics: Physics) -> Interval:
    return physics.clutch_from_s, physics.clutch_to_s


EFFECT = HiddenEffect(
    "generator_coupled", Place.MOTOR, True, _draw, _apply, when=_when, fitted={"inertia_kg_m2": "inertia_kg_m2"}
)
