"""One bus with its road and driver, drawn from a seed: what no two buses of a fleet have in common.

Assumed, as no source gives such values of one vehicle: a city bus of 10 to 19 t at 20 to 40 km/h.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.buses.line import Line

METRES_PER_RAD = 0.48 / 5.6
"""Wheel radius over gear ratio: metres driven per radian of the motor."""

AIR_KG_M3, DRAG_AREA_M2 = 1.2, 5.0
"""c_d A of a city bus: 0.65 times some 7.7 m^2 of front."""


@dataclass(frozen=True, slots=True)
class Road:
    """What the load torque varies with.

    Attributes
    ----------
    roughness_m3
        Displacement spectrum at 0.1 cycles per metre, G_d(n_0) of ISO 8608 [m^3]: 16e-6 is class A, 256e-6 class C.
    grade_nm
        RMS of the torque that hills take, at the motor [Nm].
    gust_nm
        RMS of the torque that gusts take, at the motor [Nm].
    """

    roughness_m3: float
    grade_nm: float
    gust_nm: float


@dataclass(frozen=True, slots=True)
class Driver:
    """Who holds the speed.

    Attributes
    ----------
    reading_s
        Time constant of the speedometer [s].
    reaction_s
        From what it shows to the foot [s].
    pedal_s
        Time constant of foot, pedal and torque ramp together [s].
    bandwidth_rad_s
        Crossover of the loop that the driver closes [rad/s].
    """

    reading_s: float
    reaction_s: float
    pedal_s: float
    bandwidth_rad_s: float


@dataclass(frozen=True, slots=True)
class Bus:
    """A bus on its way.

    Attributes
    ----------
    seed
        It was drawn from.
    line
        The driveline, the truth of what is identified.
    speed_rad_s
        Motor speed that is held [rad/s].
    share
        Of the driver's torque that inverter 1 gives.
    prbs_nm
        Amplitude of the PRBS, both inverters together [Nm].
    ripple_nm
        RMS of what an inverter's torque departs from its command [Nm].
    noise_rad_s
        RMS of the speed's noise, white [rad/s].
    road, driver
        Around the line.
    """

    seed: int
    line: Line
    speed_rad_s: float
    share: float
    prbs_nm: float
    ripple_nm: float
    noise_rad_s: float
    road: Road
    driver: Driver

    @property
    def speed_m_s(self) -> float:
        """Speed on the road [m/s]."""
        return self.speed_rad_s * METRES_PER_RAD

    @property
    def mass_kg(self) -> float:
        """The mass that is the load's inertia [kg]."""
        return self.line.J_L / METRES_PER_RAD**2


def draw_bus(seed: int) -> Bus:
    """Return the bus of a seed."""
    rng = np.random.default_rng([37, seed])
    speed_rad_s = float(rng.uniform(65.0, 125.0))
    line = _draw_line(rng, speed_rad_s)
    return Bus(
        seed=seed,
        line=line,
        speed_rad_s=speed_rad_s,
        share=float(rng.uniform(0.4, 0.6)),
        prbs_nm=float(rng.uniform(15.0, 60.0)),
        ripple_nm=float(rng.uniform(0.2, 0.5)),
        noise_rad_s=float(rng.uniform(0.02, 0.05)),
        road=Road(
            roughness_m3=1e-6 * float(np.exp(rng.uniform(math.log(4.0), math.log(128.0)))),
            grade_nm=float(rng.uniform(10.0, 60.0)),
            gust_nm=float(rng.uniform(3.0, 15.0)),
        ),
        driver=_draw_driver(rng),
    )


def _draw_driver(rng: np.random.Generator) -> Driver:
    """Return a driver whose loop crosses over where its lags together take 11 to 23 degrees of phase."""
    reading_s, reaction_s, pedal_s = (float(rng.uniform(*ends)) for ends in ((0.2, 0.5), (0.3, 1.0), (0.15, 0.5)))
    bandwidth_rad_s = float(rng.uniform(0.2, 0.4)) / (reading_s + reaction_s + pedal_s)
    return Driver(reading_s, reaction_s, pedal_s, bandwidth_rad_s)


def _draw_line(rng: np.random.Generator, speed_rad_s: float) -> Line:
    """Return the line whose resonance and damping are near what is drawn; friction has its small part in both."""
    J_M, J_L = float(rng.uniform(1.2, 2.2)), float(rng.uniform(70.0, 140.0))
    omega, zeta = 2.0 * math.pi * float(rng.uniform(5.0, 12.0)), float(rng.uniform(0.02, 0.10))
    b_M, b_bearings = float(rng.uniform(0.05, 0.4)), float(rng.uniform(0.2, 1.2))
    drag = AIR_KG_M3 * DRAG_AREA_M2 * speed_rad_s * METRES_PER_RAD**3
    joint = J_M * J_L / (J_M + J_L)
    c = joint * (2.0 * zeta * omega - b_M / J_M)
    return Line(J_M, J_L, k=joint * omega**2, c=c, b_M=b_M, b_L=b_bearings + drag)
