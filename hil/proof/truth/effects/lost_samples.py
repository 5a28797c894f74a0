"""Samples that never came: NaN and a flag in their row, or a 0 that nobody flagged.

Torques, speed, or all of them; single ones, or bursts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform

WHAT = ((True, True, True), (True, True, False), (True, False, True), (False, True, False), (False, False, True))
"""What one loss takes along: torque of m1, torque of m2, speed."""


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    m1, m2, speed = WHAT[rng.integers(len(WHAT))]
    burst = bool(rng.random() < 0.5)
    return {
        "share": log_uniform(rng, 0.003, 0.02) if burst else log_uniform(rng, 0.01, 0.06),
        "most": float(rng.integers(3, 11)) if burst else 1.0,
        "m1": float(m1),
        "m2": float(m2),
        "speed": float(speed),
        "as_zero": float(rng.random() < 1 / 3),
    }


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(
        acquisition,
        lost_share=sizes["share"],
        lost_most=int(sizes["most"]),
        lost_m1=bool(sizes["m1"]),
        lost_m2=bool(sizes["m2"]),
        lost_speed=bool(sizes["speed"]),
        lost_as_zero=bool(sizes["as_zero"]),
    )


EFFECT = HiddenEffect("lost_samples", Place.ACQUISITION, True, _draw, corrupt=_corrupt)
