"""Twist of the shaft from what is measured: a steady-state Kalman filter of the two-mass model.

The twist is not measured; it follows from the motor's motion, since what the motor's torque does not spend on its own
inertia and friction goes into the shaft::
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from estimator.identification.modes.modes import Mode
from estimator.physics.model import DrivelineModel, Motion, Structure
from estimator.signals.record import FloatArray

TWIST = 2
"""Place of phi in the state [w_M, w_L, phi, T_L]."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """How far signals and model are trusted; the first two are the bus's own figures (docs/formats.md)."""

    speed_rad_s: float = 0.05  # standard deviation of the speed reading [rad/s]
    torque_nm: float = 1.0  # standard deviation of the torque over one period, beyond its reading [Nm]
    load_nm_per_sqrt_s: float = 50.0  # how fast the load torque walks


@dataclass(frozen=True, slots=True)
class Shaft:
    """The numbers of a two-mass model, at the motor shaft: kg m^2, Nm/rad, Nm s/rad; and where they are from."""

    J_M: float
    J_L: float
    k: float
    c: float
    b_M: float
    b_L: float
    source: str

    @classmethod
    def of_model(cls, model: DrivelineModel, source: str) -> Shaft | None:
        if model.structure is not Structure.TWO_MASS or model.motion is not Motion.ROTATION:
            return None
        values = model.values()
        return cls(**{name: float(values[name]) for name in model.structure.parameter_names}, source=source)

    def with_resonance(self, mode: Mode) -> Shaft:
        """Take k and c from a resonance, the inertias staying as they are.

        With J = J_M J_L / (J_M + J_L): k = J w^2 and c = 2 J zeta w, w the natural frequency [rad/s]; exact for a
        shaft between two free inertias, friction left out.
        """
        inertia = self.J_M * self.J_L / (self.J_M + self.J_L)
        w = 2.0 * math.pi * mode.frequency_hz
        return replace(self, k=inertia * w * w, c=2.0 * inertia * mode.damping * w, source="resonance")


class TwistFilter:
    """The filter with its state."""

    def __init__(self, shaft: Shaft, period_s: float, uncertainty: Uncertainty | None = None) -> None:
        self._period_s = period_s
        self._uncertainty = uncertainty or Uncertainty()
        self._x: FloatArray = np.zeros(4)
        self._begun = False
        self._torque_nm = 0.0
        self.use(shaft)

    def use(self, shaft: Shaft) -> None:
        """Continue with other numbers, from the present state."""
        self.shaft = shaft
        self._F, self._g = _discrete(shaft, self._period_s)
        u = self._uncertainty
        Q = np.outer(self._g, self._g) * u.torque_nm**2
        Q[3, 3] += u.load_nm_per_sqrt_s**2 * self._period_s
        h = np.array([[1.0, 0.0, 0.0, 0.0]])
        P = solve_discrete_are(self._F.T, h.T, Q, np.array([[u.speed_rad_s**2]]))
        gain = P[:, 0] / (P[0, 0] + u.speed_rad_s**2)
        self._gain: FloatArray = np.asarray(gain, dtype=np.float64)
        self.twist_std_rad = math.sqrt(max(0.0, float(P[TWIST, TWIST] - gain[TWIST] * P[0, TWIST])))

    def step(self, torque_nm: float, speed_rad_s: float, okay: bool) -> float:
        """Take one sample."""
        if okay:
            if not self._begun:
                self._begun = True
                self._x[:2] = speed_rad_s
            self._x = self._x + self._gain * (speed_rad_s - self._x[0])
            self._torque_nm = torque_nm
        twist_rad = float(self._x[TWIST]) if self._begun else math.nan
        if self._begun:
            self._x = self._F @ self._x + self._g * self._torque_nm
        return twist_rad


def _discrete(shaft: Shaft, period_s: float) -> tuple[FloatArray, FloatArray]:
    """Return F, shape (4, 4), and g, shape (4,), for a torque held over one period."""
    s = shaft
    A = np.zeros((5, 5))
    A[0, :3] = -(s.b_M + s.c) / s.J_M, s.c / s.J_M, -s.k / s.J_M
    A[1, :4] = s.c / s.J_L, -(s.b_L + s.c) / s.J_L, s.k / s.J_L, -1.0 / s.J_L
    A[2, :2] = 1.0, -1.0
    A[0, 4] = 1.0 / s.J_M
    moved = expm(A * period_s)
    return np.asarray(moved[:4, :4], dtype=np.float64), np.asarray(moved[:4, 4], dtype=np.float64)
