"""The linear two-mass driveline that the simulation has for certain: matrices, poles, zeros, frequency response.

::

    x = [w_M, w_L, phi_M - phi_L]          dx/dt = A x + B [T, T_0]          y = w_M

with the torque T of the motor and the load torque T_0, all reflected to the motor shaft (`estimator.physics.model`).
What the estimators see of it is T held for one period of the recording and y sampled with it: an exact discretisation
by the exponential of a matrix, which is where the frequency response comes from.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from estimator.identification.modes.modes import Mode, two_mass_resonance

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

STATES, INPUTS = 3, 2


@dataclass(frozen=True, slots=True)
class TwoMassLine:
    """A two-mass driveline without anything nonlinear.

    Attributes
    ----------
    inertia_motor_kg_m2, inertia_load_kg_m2
        J_M and J_L [kg m^2].
    stiffness_nm_per_rad, damping_nm_s_per_rad
        k and c of the shaft.
    friction_motor_nm_s_per_rad, friction_load_nm_s_per_rad
        Viscous friction b_M and b_L.
    """

    inertia_motor_kg_m2: float
    inertia_load_kg_m2: float
    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float
    friction_motor_nm_s_per_rad: float
    friction_load_nm_s_per_rad: float

    @classmethod
    def of(cls, values: Mapping[str, float]) -> TwoMassLine:
        """Take the parameters of a two-mass model by their names in a model file: J_M, J_L, k, c, b_M, b_L."""
        return cls(*(values[name] for name in ("J_M", "J_L", "k", "c", "b_M", "b_L")))

    @property
    def matrices(self) -> tuple[FloatArray, FloatArray]:
        """A, shape (3, 3), and B, shape (3, 2); see the module's text."""
        j_m, j_l = self.inertia_motor_kg_m2, self.inertia_load_kg_m2
        k, c = self.stiffness_nm_per_rad, self.damping_nm_s_per_rad
        a = np.array(
            [
                [-(c + self.friction_motor_nm_s_per_rad) / j_m, c / j_m, -k / j_m],
                [c / j_l, -(c + self.friction_load_nm_s_per_rad) / j_l, k / j_l],
                [1.0, -1.0, 0.0],
            ]
        )
        return a, np.array([[1.0 / j_m, 0.0], [0.0, -1.0 / j_l], [0.0, 0.0]])

    def discrete(self, period_s: float) -> tuple[FloatArray, FloatArray]:
        """Return A and B for both torques held over a period [s]: the exponential of [[A, B], [0, 0]] T."""
        block = np.zeros((STATES + INPUTS, STATES + INPUTS))
        block[:STATES, :STATES], block[:STATES, STATES:] = self.matrices
        exponential = expm(block * period_s)
        return exponential[:STATES, :STATES], exponential[:STATES, STATES:]

    @property
    def resonance(self) -> Mode | None:
        """The oscillating pair of poles; None if it does not oscillate."""
        return two_mass_resonance(
            self.inertia_motor_kg_m2,
            self.inertia_load_kg_m2,
            self.stiffness_nm_per_rad,
            self.damping_nm_s_per_rad,
            self.friction_motor_nm_s_per_rad,
            self.friction_load_nm_s_per_rad,
        )

    def poles(self, sample_time_s: float) -> ComplexArray:
        """Return the three poles in z, exp(s T) of those in s."""
        a, _ = self.matrices
        return np.exp(np.linalg.eigvals(a).astype(np.complex128) * sample_time_s)

    def zeros(self, sample_time_s: float) -> ComplexArray:
        """Return exp(s T) of the two zeros from T to w_M: the load on its shaft, ``J_L s^2 + (c + b_L) s + k``.

        A sampled model has its zeros there only roughly, the better the slower they are.
        """
        s = np.roots(
            [
                self.inertia_load_kg_m2,
                self.damping_nm_s_per_rad + self.friction_load_nm_s_per_rad,
                self.stiffness_nm_per_rad,
            ]
        )
        return np.exp(s.astype(np.complex128) * sample_time_s)

    def response(self, frequency_hz: FloatArray, held_s: float) -> ComplexArray:
        """Return the frequency response from T to w_M [rad/s per Nm] for a torque held over ``held_s``, shape (M,)."""
        a, b = self.discrete(held_s)
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) * held_s)
        states = np.linalg.solve(z[:, np.newaxis, np.newaxis] * np.eye(STATES) - a, b[:, :1])
        return np.asarray(states[:, 0, 0], dtype=np.complex128)
