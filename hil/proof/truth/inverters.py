"""From the inverters' readings to the torque they give: everything between that has no dynamics of its own.

In this order: gain of m1, deadband, derating with time, limit of each inverter, sum, limit of the sum, saturation of
the machine, offset, failures.
"""

from __future__ import annotations

import math

import numpy as np

from hil.proof.truth import laws_in_time
from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import FloatArray, Physics


@compiled
def true_torques(p: Physics, m1_nm: FloatArray, m2_nm: FloatArray, times_s: FloatArray) -> FloatArray:
    """Return `true_torque` for readings and times of shape (N,)."""
    total_nm = np.empty(times_s.size)
    for i in range(times_s.size):
        total_nm[i] = true_torque(p, (m1_nm[i], m2_nm[i]), times_s[i])
    return total_nm


@compiled
def true_torque(p: Physics, reading_nm: tuple[float, float], time_s: float) -> float:
    """Return the torque of both inverters together for their readings at a time [Nm]."""
    left = laws_in_time.torque_left(p, time_s)
    m1 = left * _beyond(p.gain_m1 * reading_nm[0], p.deadband_nm)
    m2 = left * _beyond(reading_nm[1], p.deadband_nm)
    both = _limited(m1, p.limit_m1_nm, p.limit_knee) + _limited(m2, p.limit_m2_nm, p.limit_knee)
    given = _saturated(p, _limited(both, p.limit_total_nm, p.limit_knee)) + laws_in_time.bias_torque(p, time_s)
    return 0.0 if laws_in_time.is_blocked(p, time_s) else given


@compiled
def _beyond(torque_nm: float, deadband_nm: float) -> float:
    return math.copysign(max(0.0, abs(torque_nm) - deadband_nm), torque_nm)


@compiled
def _saturated(p: Physics, torque_nm: float) -> float:
    """Return ``S asinh(T / S)``: nearly T while small, growing ever less."""
    size = p.saturating_nm if torque_nm > 0.0 else p.saturating_back_nm
    return size * math.asinh(torque_nm / size) if size > 0.0 else torque_nm


@compiled
def _limited(torque_nm: float, limit_nm: float, knee: float) -> float:
    """Return a torque below its limit, which is approached in a knee and not at an edge."""
    if limit_nm <= 0.0:
        return torque_nm
    over = abs(torque_nm) / limit_nm
    return float(torque_nm * (1.0 + over**knee) ** (-1.0 / knee))
