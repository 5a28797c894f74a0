"""A two-mass driveline under a PRBS, discretised by scipy: the truth that the monitor's figures are held against."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.physics.joint import Shaft
from estimator.signals.prbs import Prbs
from tests.estimator.identification.driveline import Line

FloatArray = NDArray[np.float64]

PERIOD_S = 0.01


@dataclass(frozen=True)
class Drive:
    """Torque, motor speed and twist of every cycle, shape (n,) each."""

    torque_nm: FloatArray
    speed_rad_s: FloatArray
    twist_rad: FloatArray


def driven(
    shaft: Shaft,
    n: int,
    seed: int,
    speed_std_rad_s: float = 0.0,
    torque_std_nm: float = 0.0,
    load_nm_per_sqrt_s: float = 0.0,
) -> Drive:
    """Drive the line at rest by a PRBS; what acts differs from the torque read by white noise, the load walks."""
    line = Line(k=shaft.k, J_L=shaft.J_L, J_M=shaft.J_M, c=shaft.c, b_motor=shaft.b_M, b_load=shaft.b_L)
    F, G = line.discrete(PERIOD_S)
    rng = np.random.default_rng(seed)
    prbs = Prbs(120.0, clock_divider=2)
    torque_nm = np.array([prbs.next() for _ in range(n)])
    acting = torque_nm + torque_std_nm * rng.standard_normal(n)
    load = np.cumsum(load_nm_per_sqrt_s * np.sqrt(PERIOD_S) * rng.standard_normal(n))
    x = np.zeros(3)
    states = np.empty((n, 3))
    for k in range(n):
        states[k] = x
        x = F @ x + G @ np.array([acting[k], load[k]])
    return Drive(torque_nm, states[:, 0] + speed_std_rad_s * rng.standard_normal(n), states[:, 2])
