"""What differs from one on-road experiment to the next: speed, payload, road, wind and driver.

The paper says that its tests vary by "driver interaction, road and weather conditions" and gives no numbers. These
are assumed, for a city bus of 12 to 16 t in series mode at 20 to 35 km/h.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PRBS_STATES = 1023
"""States of a ten-cell shift register."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """One experiment's conditions.

    Attributes
    ----------
    speed_rad_s
        Motor speed that the driver holds [rad/s].
    payload_kg
        Mass on board on top of the empty bus's [kg]; negative where the rig's model already carries some.
    slope_rms
        How hilly the road is: RMS of rise over run.
    wind_m_s, gust_m_s
        Mean head wind and standard deviation of its gusts [m/s].
    roughness_nm
        RMS of what the road surface adds to the load torque, at the motor shaft [Nm].
    pedal_nm
        Standard deviation of the driver's corrections by the pedal [Nm].
    prbs_seed
        First state of the shift register.
    seed
        Of road, wind, driver and reading noise.
    """

    speed_rad_s: float
    payload_kg: float
    slope_rms: float
    wind_m_s: float
    gust_m_s: float
    roughness_nm: float
    pedal_nm: float
    prbs_seed: int
    seed: int


def draw_conditions(seed: int, count: int) -> tuple[Conditions, ...]:
    """Draw the conditions of ``count`` experiments; those of the first ones do not depend on how many follow."""
    return tuple(_draw(np.random.default_rng([seed, number])) for number in range(count))


def _draw(rng: np.random.Generator) -> Conditions:
    return Conditions(
        speed_rad_s=float(rng.uniform(65.0, 110.0)),
        payload_kg=float(rng.uniform(-1500.0, 2500.0)),
        slope_rms=float(rng.uniform(0.001, 0.004)),
        wind_m_s=float(rng.uniform(-4.0, 6.0)),
        gust_m_s=float(rng.uniform(0.5, 2.0)),
        roughness_nm=float(rng.uniform(3.0, 12.0)),
        pedal_nm=float(rng.uniform(5.0, 20.0)),
        prbs_seed=int(rng.integers(1, PRBS_STATES + 1)),
        seed=int(rng.integers(2**31)),
    )
