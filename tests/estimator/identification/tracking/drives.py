"""Drives whose physics changes on the way, many at once: exact discretisation by scipy, nothing of this project."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import max_len_seq

from estimator.signals.record import Record
from tests.estimator.identification.driveline import SAMPLE_TIME_S, Line

SPEED_RAD_S = 60.0
PRBS_NM = 120.0
CLOCK_DIVIDER = 2
TORQUE_STEP_NM = 1.2
"""0.1 % of 600 Nm, of two inverters."""


def drives(
    seed: int,
    number: int,
    duration_s: float,
    lines: Sequence[Line] = (Line(),),
    noise_rad_s: float = 0.05,
    road_nm: float = 300.0,
    prbs_nm: Callable[[float], float] = lambda time_s: PRBS_NM,
    hold_nm_s_per_rad: float = 40.0,
) -> list[Record]:
    """Simulate drives at a held speed: PRBS, wandering load, rough road (white load torque), noisy resolver.

    The speed is held without any lag: with the 40 Nm s/rad there are, torque follows the speed also without a PRBS.
    """
    rng = np.random.default_rng(seed)
    n = round(duration_s / SAMPLE_TIME_S)
    sequence = np.repeat(2.0 * max_len_seq(10)[0] - 1.0, CLOCK_DIVIDER)
    starts = rng.integers(0, sequence.shape[0], number)
    steps = {round(line.from_s / SAMPLE_TIME_S): line.discrete() for line in lines}
    twist = 150.0 / lines[0].k
    x = np.tile([SPEED_RAD_S, SPEED_RAD_S, twist], (number, 1))
    base, wander = np.full(number, 204.0), np.zeros(number)
    torque, speed = np.empty((number, n)), np.empty((number, n))
    for t in range(n):
        if t in steps:
            Ad, Bd = (matrix.T for matrix in steps[t])
        slow = SPEED_RAD_S - x[:, 1]
        base += SAMPLE_TIME_S * 5.0 * slow
        wander = 0.9998 * wander + rng.normal(0.0, 0.5, number)
        load = 150.0 + wander + rng.normal(0.0, road_nm, number)
        wanted = (
            base + hold_nm_s_per_rad * slow + prbs_nm(t * SAMPLE_TIME_S) * sequence[(starts + t) % sequence.shape[0]]
        )
        torque[:, t] = np.round(wanted / TORQUE_STEP_NM) * TORQUE_STEP_NM
        speed[:, t] = x[:, 0]
        x = x @ Ad + np.column_stack([torque[:, t], load]) @ Bd
    measured = torque + rng.normal(0.0, 0.4, torque.shape)
    speed += rng.normal(0.0, noise_rad_s, speed.shape)
    time_s = SAMPLE_TIME_S * np.arange(n)
    okay = np.ones(n, dtype=np.bool_)
    return [
        Record(f"drive_{i}", SAMPLE_TIME_S, time_s, np.column_stack([u / 2, u / 2]), y, okay)
        for i, (u, y) in enumerate(zip(measured, speed, strict=True))
    ]
