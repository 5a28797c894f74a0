"""A bus drawn at random: what it really is, and what its maker's data sheet says it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hil.proof.truth.physics import Physics

STANDARD_GRAVITY_M_S2 = 9.80665

NOMINAL_ERROR = 0.15
"""Each nominal value is off by up to this share of the true one."""

NOMINAL_TOLERANCE = 0.2
"""Tolerance stated in the nominal model: wide enough that ``true = nominal (1 + tolerance)`` is never passed
(1 / 0.85 = 1.18)."""


@dataclass(frozen=True, slots=True)
class Bus:
    """The true driveline of one bus, reflected to the motor shaft, without anything hidden.

    Attributes
    ----------
    J_M, J_L : float
        Inertia of motor and load [kg m^2].
    k, c : float
        Shaft stiffness [Nm/rad] and damping [Nm s/rad].
    b_M, b_L : float
        Viscous friction [Nm s/rad].
    load_torque_nm : float
        Rolling resistance: constant torque against the load.
    gear_ratio : float
        Motor turns per wheel turn.
    wheel_radius_m : float
        Rolling radius.
    """

    J_M: float
    J_L: float
    k: float
    c: float
    b_M: float
    b_L: float
    load_torque_nm: float
    gear_ratio: float
    wheel_radius_m: float

    @property
    def metres_per_rad(self) -> float:
        """Distance driven per radian of the motor."""
        return self.wheel_radius_m / self.gear_ratio

    @property
    def gravity_nm(self) -> float:
        """Load torque per unit of slope; the vehicle's mass is what makes J_L."""
        mass_kg = self.J_L / self.metres_per_rad**2
        return mass_kg * STANDARD_GRAVITY_M_S2 * self.metres_per_rad

    def physics(self) -> Physics:
        """Return the simulator's physics with nothing hidden."""
        return Physics(
            J_M=self.J_M,
            J_L=self.J_L,
            k=self.k,
            c=self.c,
            b_M=self.b_M,
            b_L=self.b_L,
            load_torque_nm=self.load_torque_nm,
            metres_per_rad=self.metres_per_rad,
            gravity_nm=self.gravity_nm,
            gear_ratio=self.gear_ratio,
        )


def draw_bus(rng: np.random.Generator) -> Bus:
    """Draw a bus: 12 to 18 t, first shaft resonance 6 to 10 Hz."""
    return Bus(
        J_M=rng.uniform(1.4, 2.2),
        J_L=rng.uniform(80.0, 110.0),
        k=rng.uniform(3000.0, 5500.0),
        c=rng.uniform(8.0, 14.0),
        b_M=rng.uniform(0.25, 0.45),
        b_L=rng.uniform(0.6, 1.2),
        load_torque_nm=rng.uniform(30.0, 80.0),
        gear_ratio=5.6,
        wheel_radius_m=0.48,
    )


def draw_nominal(bus: Bus, rng: np.random.Generator, error: float = NOMINAL_ERROR) -> dict[str, float]:
    """Return the six values of the nominal model, each off by up to a share of the true one."""
    names = ("J_M", "J_L", "k", "c", "b_M", "b_L")
    return {name: getattr(bus, name) * (1.0 + rng.uniform(-error, error)) for name in names}
