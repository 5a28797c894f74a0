"""The bus of the pictures of docs/catalogue.md, and the three tests it is driven through."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.signals.record import FloatArray

PERIOD_S = 0.01
BUS = {"J_M": 1.6, "J_L": 100.0, "k": 4200.0, "c": 9.0, "b_M": 0.35, "b_L": 0.9}
LINE = DrivelineModel(Structure.TWO_MASS, {name: Parameter(value, 0.2) for name, value in BUS.items()}, gear_ratio=5.6)
LOAD_NM = 40.0
DURATION_S = 6.0
TIME_S = np.arange(round(DURATION_S / PERIOD_S)) * PERIOD_S

Values = Mapping[str, float]


def _prbs(amplitude_nm: float) -> FloatArray:
    signs = np.random.default_rng(7).choice([-1.0, 1.0], size=TIME_S.size // 4)
    return amplitude_nm * np.repeat(signs, 4)


def _hold(speed_rad_s: float) -> float:
    return LOAD_NM + (BUS["b_M"] + BUS["b_L"]) * speed_rad_s


@dataclass(frozen=True, slots=True)
class Drive:
    """A test: torque of both inverters, shape (N, 2) [Nm], and the speed it begins at [rad/s]."""

    torque_nm: FloatArray
    speed_rad_s: float


def _drive(total_nm: FloatArray, speed_rad_s: float) -> Drive:
    share = np.where(TIME_S < 0.5 * DURATION_S, 0.5, 0.7)
    return Drive(np.column_stack([share * total_nm, (1.0 - share) * total_nm]), speed_rad_s)


DRIVES = {
    "cruise": _drive(_hold(40.0) + _prbs(60.0), 40.0),
    "reversal": _drive(LOAD_NM + 350.0 * np.cos(2.0 * np.pi * TIME_S / DURATION_S) + _prbs(40.0), 0.0),
    "tip": _drive(_hold(25.0) + 350.0 * np.where(TIME_S % 2.0 < 1.0, 1.0, -1.0), 25.0),
}
