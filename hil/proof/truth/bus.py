"""A bus drawn at random with its maker's data sheet, and the three tests of 30 s that it is driven through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from hil.proof.truth.physics import FloatArray, Physics

STANDARD_GRAVITY_M_S2 = 9.80665

NOMINAL_ERROR = 0.15  # each nominal value is off by up to this share of the true one

NOMINAL_TOLERANCE = 0.2
"""Tolerance stated in the nominal model: wide enough that ``true = nominal (1 + tolerance)`` is never passed
(1 / 0.85 = 1.18)."""

PERIOD_S = 0.01
SAMPLES = 3000
DURATION_S = SAMPLES * PERIOD_S


@dataclass(frozen=True, slots=True)
class Bus:
    """The true driveline of one bus, reflected to the motor shaft, without anything hidden."""

    J_M: float  # inertia of the motor [kg m^2]
    J_L: float  # inertia of the load [kg m^2]
    k: float  # shaft stiffness [Nm/rad]
    c: float  # shaft damping [Nm s/rad]
    b_M: float  # viscous friction at the motor [Nm s/rad]
    b_L: float  # viscous friction at the load [Nm s/rad]
    load_torque_nm: float  # rolling resistance
    gear_ratio: float  # motor turns per wheel turn
    wheel_radius_m: float  # rolling radius

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


class Test(Enum):
    """Kinds of test, in the order of the recordings."""

    CRUISE = "cruise"
    REVERSAL = "reversal"
    TIP_IN_OUT = "tip_in_out"


@dataclass(frozen=True, slots=True)
class Plan:
    """What the driver does in one test."""

    speed_rad_s: float  # motor speed the bus rolls at when the recording begins, on level road
    torque_nm: FloatArray  # (N,): Torque of both inverters on top of what holds that speed
    share_m1: float  # part of the torque that inverter m1 gives


def _prbs(rng: np.random.Generator, amplitude_nm: float) -> FloatArray:
    """Pseudo-random binary torque of a ten-cell shift register, a bit every two or three samples."""
    cells = rng.integers(0, 2, 10)
    cells[rng.integers(0, 10)] = 1  # a register of zeros would stay there
    hold = int(rng.integers(2, 4))
    bits = np.empty(SAMPLES // hold + 1)
    for i in range(bits.size):
        bits[i] = cells[9]
        cells = np.concatenate(([cells[9] ^ cells[6]], cells[:9]))
    signs: FloatArray = 2.0 * np.repeat(bits, hold)[:SAMPLES] - 1.0
    return amplitude_nm * signs


def sample_times_s() -> FloatArray:
    """Return the time of each row, shape (SAMPLES,)."""
    return np.arange(SAMPLES, dtype=np.float64) * PERIOD_S


def _cruise(rng: np.random.Generator) -> Plan:
    slow = rng.uniform(20.0, 60.0) * np.sin(2.0 * np.pi * (sample_times_s() / rng.uniform(18.0, 25.0) + rng.random()))
    return Plan(rng.uniform(45.0, 90.0), slow + _prbs(rng, rng.uniform(100.0, 130.0)), rng.uniform(0.45, 0.55))


def _reversal(rng: np.random.Generator) -> Plan:
    phase = 2.0 * np.pi * sample_times_s() / rng.uniform(10.0, 14.0) + rng.uniform(-1.2, -0.2)
    swing = rng.uniform(330.0, 450.0) * np.cos(phase)
    return Plan(0.0, swing + _prbs(rng, rng.uniform(55.0, 75.0)), rng.uniform(0.6, 0.7))


def _tip_in_out(rng: np.random.Generator) -> Plan:
    pedal = np.sign(np.sin(2.0 * np.pi * (sample_times_s() / rng.uniform(2.2, 3.0) + rng.random())))
    torque = rng.uniform(170.0, 210.0) * pedal + _prbs(rng, rng.uniform(50.0, 65.0))
    return Plan(rng.uniform(40.0, 80.0), torque, rng.uniform(0.3, 0.4))


_PLANS: dict[Test, Callable[[np.random.Generator], Plan]] = {
    Test.CRUISE: _cruise,
    Test.REVERSAL: _reversal,
    Test.TIP_IN_OUT: _tip_in_out,
}


def draw_plan(test: Test, rng: np.random.Generator) -> Plan:
    """Draw what the driver does in a test of a kind."""
    return _PLANS[test](rng)
