"""Inverter and speed sensor have clocks of their own, and one is faster: rows pair what is ever further apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes, either, log_uniform


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {"clock_error": either(rng, log_uniform(rng, 60e-6, 3000e-6))}


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(acquisition, clock_error=sizes["clock_error"])


EFFECT = HiddenEffect("clock_drift", Place.ACQUISITION, True, _draw, corrupt=_corrupt, fitted={"rate": "clock_error"})
