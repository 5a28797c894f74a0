"""A tyre that slips: the slip builds up over a rolled distance, and the torque saturates with it.

H. B. Pacejka, Tire and Vehicle Dynamics, 3rd ed.: magic formula (chapter 4), relaxation length (chapter 7).
"""

from __future__ import annotations

import math

from hil.proof.truth.compiled import compiled
from hil.proof.truth.physics import Physics

SHAPE = 1.6
"""Shape factor of the magic formula for longitudinal slip."""

STANDSTILL_DAMPING_S = 0.01
STANDSTILL_SPEED_RAD_S = 5.0
"""The carcass damps the wheel's wind-up near standstill, where rolling can't relax it: damping over the contact's
stiffness, and the speed at which rolling takes over (Pacejka, section 8.6)."""


@compiled
def slip_after(slip: float, p: Physics, speed_wheel: float, speed_vehicle: float, time_s: float) -> float:
    """Return the slip after ``time_s`` at constant speeds; exact solution of ``s dk/dt = v_w - v_v - |v_v| k``."""
    rate = abs(speed_vehicle) / p.relaxation_rad
    sliding = (speed_wheel - speed_vehicle) / p.relaxation_rad
    decay = -math.expm1(-rate * time_s)
    if decay < 1e-9:
        return slip + sliding * time_s
    return slip + (sliding / rate - slip) * decay


@compiled
def torque(p: Physics, slip: float, speed_wheel: float, speed_vehicle: float) -> float:
    """Return the torque from wheel to vehicle [Nm]."""
    rolling = 1.0 + (speed_vehicle / STANDSTILL_SPEED_RAD_S) ** 2
    damped = slip + STANDSTILL_DAMPING_S * (speed_wheel - speed_vehicle) / (p.relaxation_rad * rolling)
    return p.grip_nm * math.sin(SHAPE * math.atan(p.slip_stiffness_nm / (SHAPE * p.grip_nm) * damped))
