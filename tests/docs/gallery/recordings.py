"""Recordings of the two-mass bus, by its equations sampled exactly; and recordings read, changed and written again."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from estimator.signals.record import FloatArray
from hil.recording import Table, read_table, write_table
from tests.docs.bus import BUS, PERIOD_S

SPEED_RAD_S = 40.0
SPEED_NOISE_RAD_S = 0.05
TORQUE_STEP_NM = 0.6
"""0.1 % of a rated torque of 600 Nm: what the reading is rounded to."""


def cruise(path: Path, prbs_nm: float, gain_nm_s: float = 0.0, duration_s: float = 30.0) -> Path:
    """Write a cruise of the bus at 10 ms."""
    rng = np.random.default_rng(3)
    samples = round(duration_s / PERIOD_S)
    transition, drive = _sampled()
    prbs = np.repeat(rng.choice([-prbs_nm, prbs_nm], size=samples // 2 + 1), 2)[:samples]
    hold_nm = (BUS["b_M"] + BUS["b_L"]) * SPEED_RAD_S
    state = np.array([SPEED_RAD_S, SPEED_RAD_S, (hold_nm - BUS["b_M"] * SPEED_RAD_S) / BUS["k"]])
    torque, speed = np.empty(samples), np.empty(samples)
    for k in range(samples):
        speed[k] = state[0] + SPEED_NOISE_RAD_S * rng.standard_normal()
        torque[k] = hold_nm + prbs[k] - gain_nm_s * (speed[k] - SPEED_RAD_S)
        state = transition @ state + drive * torque[k]
    read_nm = TORQUE_STEP_NM * np.round(0.5 * torque / TORQUE_STEP_NM)
    columns = {"torque_m1_nm": read_nm, "torque_m2_nm": read_nm, "speed_rad_s": speed}
    return save(path, {"time_s": PERIOD_S * np.arange(samples), **columns})


def _sampled() -> tuple[FloatArray, FloatArray]:
    """Return the bus under a torque held over a period: x = (w_M, w_L, twist), x[k+1] = A x[k] + B T[k]."""
    jm, jl, k, c = (BUS[name] for name in ("J_M", "J_L", "k", "c"))
    rates = np.array(
        [
            [-(c + BUS["b_M"]) / jm, c / jm, -k / jm, 1.0 / jm],
            [c / jl, -(c + BUS["b_L"]) / jl, k / jl, 0.0],
            [1.0, -1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0],
        ]
    )
    sampled = expm(rates * PERIOD_S)
    return sampled[:3, :3], sampled[:3, 3]


def save(path: Path, columns: Mapping[str, FloatArray]) -> Path:
    """Write columns as a recording; one that is there is replaced."""
    path.unlink(missing_ok=True)
    write_table(Table(path, dict(columns)), path)
    return path


def columns_of(path: Path) -> dict[str, FloatArray]:
    """Return the columns of a recording."""
    return {name: np.array(values, dtype=float) for name, values in read_table(path).columns.items()}
