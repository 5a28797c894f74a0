"""The previous value is recorded once more: a transmit buffer that was not refilled in time.

Of the speed or of the whole row; at random, or in a fixed beat of two clocks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, log_uniform


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    periodic = bool(rng.random() < 0.5)
    share = log_uniform(rng, 0.003, 0.05)
    return {
        "share": 0.0 if periodic else share,
        "most": 0.0 if periodic else float(rng.integers(1, 4)),
        "every": np.ceil(1.0 / share) if periodic else 0.0,
        "whole_rows": float(rng.random() < 0.4),
    }


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(
        acquisition,
        stale_share=sizes["share"],
        stale_most=int(sizes["most"]),
        stale_every=int(sizes["every"]),
        stale_rows=bool(sizes["whole_rows"]),
    )


def _true_share(sizes: Sizes, bus: Mapping[str, float]) -> float | None:
    """Share of repeats in a beat; of random ones each recording has its own."""
    return 1.0 / sizes["every"] if sizes["every"] else None


EFFECT = HiddenEffect("stale_samples", Place.ACQUISITION, True, _draw, corrupt=_corrupt, fitted={"share": _true_share})
