"""What the people on board feel of a test: the vehicle's acceleration along the road.

ISO 2631-1:1997, annex C.2.3, calls a frequency-weighted acceleration below 0.315 m/s2 RMS not uncomfortable. The
acceleration is used unweighted here: the weighting W_d for the direction of travel is nowhere above 1.02, and falls
with frequency above 2 Hz, so that the figure is on the safe side.

The vehicle is the load side of the shaft: ``J_L dw_L/dt = T - J_M dw_M/dt - friction``, with the motor's own inertia
and nothing else of a model. What is slower than 0.5 Hz is the way the test is driven and no vibration.
"""

from __future__ import annotations

import numpy as np

from estimator.physics.model import DrivelineModel, Structure
from estimator.signals.record import FloatArray

COMFORT_LIMIT_M_S2 = 0.315
"""Upper end of "not uncomfortable" [m/s2 RMS]: ISO 2631-1:1997, C.2.3."""

FELT_HZ = (0.5, 20.0)
"""Band of vibration looked at [Hz]: ISO 2631-1 begins at 0.5 Hz; above 20 Hz W_d is below 0.1, and noise begins."""

DEFAULT_TRAVEL_M_PER_RAD = 0.48 / 5.6
"""Way per radian of the motor shaft [m]: wheel radius 0.48 m over ratio 5.6, the bus assumed in DESIGN."""


def vibration_m_s2(
    torque_nm: FloatArray,
    speed_rad_s: FloatArray,
    model: DrivelineModel,
    period_s: float,
    travel_m_per_rad: float,
) -> float:
    """Return the RMS of the vehicle's acceleration in the band that is felt [m/s2].

    Parameters
    ----------
    torque_nm, speed_rad_s : ndarray, shape (N,)
        Total torque and motor speed, without gaps.
    model
        Its inertias are used, and nothing else.
    period_s
        Sampling period.
    travel_m_per_rad
        Way the vehicle makes per radian of the motor shaft.
    """
    from scipy.signal import butter, sosfiltfilt  # half a second, and the bus comes first

    values = model.values()
    acceleration = np.gradient(speed_rad_s, period_s)
    if model.structure is not Structure.ONE_MASS:
        load = sum(values[name] for name in ("J_2", "J_L") if name in values)
        acceleration = (torque_nm - values["J_M"] * acceleration) / load
    high_hz = min(FELT_HZ[1], 0.45 / period_s)
    felt = sosfiltfilt(butter(2, (FELT_HZ[0], high_hz), "bandpass", fs=1.0 / period_s, output="sos"), acceleration)
    return float(travel_m_per_rad * np.sqrt(np.mean(felt**2)))
