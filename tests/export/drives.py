"""Drives for the exported estimator: a clean cruise, and one with everything that can go wrong on a bus."""

from functools import cache

import numpy as np

from tests.estimator.identification.driveline import cruise
from tests.export.plc_runs import Cycles


@cache
def clean_drive(seed: int = 1, duration_s: float = 22.0) -> Cycles:
    """A cruise with PRBS, the torque unequally shared."""
    record = cruise(seed, duration_s=duration_s).record
    total = record.total_torque_nm
    return Cycles(0.6 * total, 0.4 * total, record.output.copy(), record.okay.copy())


def bad_drive(seed: int = 1) -> Cycles:
    """The same with NaN, infinities, absurd values and masked samples, alone and in a long stretch."""
    drive = clean_drive(seed)
    m1, m2, speed, okay = (array.copy() for array in vars(drive).values())
    rng = np.random.default_rng(seed)
    okay[rng.random(okay.shape[0]) < 0.01] = False
    for array, at, value in (
        (m1, 0, np.nan),  # before there is a good value to hold
        (speed, 1, np.nan),
        (m1, 600, np.inf),
        (m2, 700, -np.inf),
        (m1, 800, 1.7e38),
        (speed, 900, np.nan),
        (speed, 901, np.inf),
        (speed, 902, -1e35),
        (m2, 1000, np.nan),
    ):
        array[at] = value
    okay[1200:1400] = False
    return Cycles(m1, m2, speed, okay)


def still_drive() -> Cycles:
    """Torque and speed that never change: nothing to learn from."""
    n = 1000
    return Cycles(np.full(n, 50.0), np.full(n, 50.0), np.full(n, 30.0), np.ones(n, dtype=bool))
