"""The physical two-mass driveline that the extended Kalman filter estimates."""

from __future__ import annotations

from dataclasses import dataclass

from estimator.signals.settings import Requirement, is_positive, require

ESTIMATED = ("J_M", "J_L", "k", "c")
"""What the filter estimates; the frictions are given, since near a constant speed they are part of the load torque."""


@dataclass(frozen=True, slots=True)
class TwoMass:
    """Parameters reflected to the motor shaft.

    Attributes
    ----------
    J_M, J_L : float
        Inertia of motor and load [kg m^2].
    k, c : float
        Stiffness [Nm/rad] and damping [Nm s/rad] of the shaft.
    b_M, b_L : float
        Viscous friction at motor and load [Nm s/rad].

    Raises
    ------
    BadSetting
        If an inertia, the stiffness or the damping is not above 0, or a friction is below.
    """

    J_M: float
    J_L: float
    k: float
    c: float
    b_M: float = 0.0
    b_L: float = 0.0

    def __post_init__(self) -> None:
        rows = [
            Requirement(name, getattr(self, name), is_positive(getattr(self, name)), "above 0") for name in ESTIMATED
        ]
        frictions = [("b_M", self.b_M), ("b_L", self.b_L)]
        rows += [Requirement(name, value, 0 <= value < float("inf"), "0 or above") for name, value in frictions]
        require("two-mass model", rows)
