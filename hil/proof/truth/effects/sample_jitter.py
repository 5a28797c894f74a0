"""Speeds sampled too early or too late; ``time_s`` has the nominal time, or the true one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform

MOST_STAMPED_S = 0.0024
"""A recording whose time steps differ from the period by more than half of it is refused by any reader."""


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    stamped = bool(rng.random() < 0.25)
    return {"jitter_s": log_uniform(rng, 0.001, MOST_STAMPED_S if stamped else 0.003), "stamps_told": float(stamped)}


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(acquisition, jitter_s=sizes["jitter_s"], stamps_told=bool(sizes["stamps_told"]))


def _true_jitter(sizes: Sizes, bus: Mapping[str, float]) -> float:
    """Root mean square of a uniform deviation over its greatest: 1 / sqrt(3)."""
    return sizes["jitter_s"] / math.sqrt(3.0)


EFFECT = HiddenEffect(
    "sample_jitter", Place.ACQUISITION, True, _draw, corrupt=_corrupt, fitted={"jitter_s": _true_jitter}
)
