"""A speed sensor whose gain falls with the speed: a demodulator near its end of range. No catalogue entry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, either, log_uniform


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"curvature": either(rng, log_uniform(rng, 0.02, 0.15))}


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(acquisition, curvature=sizes["curvature"])


EFFECT = HiddenEffect("sensor_curvature", Place.SPEED_SENSOR, False, _draw, corrupt=_corrupt)
