"""The sensor counts pulses and can't tell which way it turns: the magnitude of the speed is read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hil.proof.truth.acquisition import Acquisition
from hil.proof.truth.bus import Bus
from hil.proof.truth.hidden import HiddenEffect, Place, Sizes


def _draw(rng: np.random.Generator, bus: Bus) -> Sizes:
    return {}


def _corrupt(acquisition: Acquisition, sizes: Sizes) -> Acquisition:
    return replace(acquisition, sign_blind=True)


EFFECT = HiddenEffect("speed_sign_blind", Place.SPEED_SENSOR, True, _draw, corrupt=_corrupt)
