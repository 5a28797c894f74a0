"""Wrong bits on the way: single speeds that are off by far. No catalogue entry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"spike_share": log_uniform(rng, 0.002, 0.02), "spike_rad_s": log_uniform(rng, 1.5, 8.0)}


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(acquisition, spike_share=sizes["spike_share"], spike_rad_s=sizes["spike_rad_s"])


EFFECT = HiddenEffect("speed_spikes", Place.ACQUISITION, False, _draw, corrupt=_corrupt)
