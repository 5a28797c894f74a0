"""The driveline as ``M q'' + D q' + K q = f`` in the angles of its two masses, and its exact solution over a period.

A torque that is held for a period h moves the state by the integral of the matrix exponential; both follow from one
exponential of an augmented matrix (C. F. Van Loan, IEEE Transactions on Automatic Control 23, 1978).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]

MOTOR, LOAD = 0, 1
STATES = 4
"""Two angles [rad], two speeds [rad/s]."""


@dataclass(frozen=True, slots=True)
class Line:
    """Inertias [kg m^2], stiffness [Nm/rad], damping and friction [Nm s/rad], reflected to the motor shaft.

    ``b_L`` is all that slows the load in proportion to its speed: bearings, and the slope of the air's drag.
    """

    J_M: float
    J_L: float
    k: float
    c: float
    b_M: float
    b_L: float

    @property
    def parameters(self) -> dict[str, float]:
        """All six by name."""
        return {name: getattr(self, name) for name in ("J_M", "J_L", "k", "c", "b_M", "b_L")}

    def system(self) -> tuple[Array, Array]:
        """Return F, G of ``x' = F x + G (motor torque, load torque)`` with x = angles and speeds, (4, 4) and (4, 2)."""
        between = np.array([[1.0, -1.0], [-1.0, 1.0]])
        stiffness, damping = self.k * between, self.c * between + np.diag([self.b_M, self.b_L])
        compliance = np.diag([1.0 / self.J_M, 1.0 / self.J_L])
        F = np.block([[np.zeros((2, 2)), np.eye(2)], [-compliance @ stiffness, -compliance @ damping]])
        G = np.vstack([np.zeros((2, 2)), compliance @ np.diag([1.0, -1.0])])
        return F, G

    def held(self, period_s: float) -> tuple[Array, Array]:
        """Return the state's move over a period [s] in which both torques are held, (4, 4) and (4, 2)."""
        F, G = self.system()
        augmented = np.zeros((STATES + 2, STATES + 2))
        augmented[:STATES, :STATES], augmented[:STATES, STATES:] = F, G
        moved = expm(period_s * augmented)
        return moved[:STATES, :STATES], moved[:STATES, STATES:]

    def resonance(self) -> tuple[float, float]:
        """Return natural frequency ``|s| / 2 pi`` [Hz] and damping ratio ``-Re s / |s|`` of the oscillating pair."""
        poles = np.linalg.eigvals(self.system()[0])
        s = complex(poles[int(np.argmax(poles.imag))])
        return abs(s) / (2.0 * math.pi), -s.real / abs(s)
