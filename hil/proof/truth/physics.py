"""Everything the truth simulator can hold, as one tuple that compiled code reads by name.

Reflected to the motor shaft, SI units. Every effect is absent at its default.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FLAT_ROAD: FloatArray = np.zeros((0, 3))
"""A height profile without hills."""


class Physics(NamedTuple):
    """A driveline with all it may hide.

    Attributes
    ----------
    J_M, J_L : float
        Inertia of motor and load [kg m^2].
    k, c : float
        Shaft stiffness [Nm/rad] and damping [Nm s/rad].
    b_M, b_L : float
        Viscous friction [Nm s/rad].
    load_torque_nm : float
        Constant torque against the load.
    friction_motor_nm, breakaway_motor_nm, stribeck_speed_rad_s : float
        Dry friction on the motor shaft: sliding at speed, at the point of breaking away, and the speed over
        which one goes over into the other.
    brake_nm, brake_from_s, brake_to_s, brake_period_s : float
        Dry friction on the load that is on during an interval of every period.
    quadratic_motor, quadratic_load : float
        Torque per speed squared [Nm s^2/rad^2].
    gap_rad : float
        Free play of the shaft, from contact to contact.
    hardening_twist_rad, softening_twist_rad : float
        Twist scale of a sinh (hardening) or asinh (softening) characteristic; 0 is a linear shaft.
    maxwell_stiffness, maxwell_time_s : float
        Second shaft branch, spring in series with damper: stiffness [Nm/rad] and relaxation time.
    gain_m1 : float
        True torque of inverter m1 over its reading.
    current_loop_time_s : float
        Time constant of the current loop of both inverters.
    delay_s : float
        Time from the torque reading to the torque.
    road : ndarray, shape (M, 3)
        Height profile, sum of M waves: height [m], wave number [rad/m], phase [rad].
    road_start_m, metres_per_rad, gravity_nm : float
        Where on the road the recording starts; distance per motor angle; load torque per unit of slope.
    resolver_once_rad, resolver_twice_rad, resolver_once_phase_rad, resolver_twice_phase_rad : float
        Angle error of the resolver at once and twice per turn.
    """

    J_M: float
    J_L: float
    k: float
    c: float
    b_M: float
    b_L: float
    load_torque_nm: float = 0.0
    friction_motor_nm: float = 0.0
    breakaway_motor_nm: float = 0.0
    stribeck_speed_rad_s: float = 1.0
    brake_nm: float = 0.0
    brake_from_s: float = 0.0
    brake_to_s: float = 0.0
    brake_period_s: float = 60.0
    quadratic_motor: float = 0.0
    quadratic_load: float = 0.0
    gap_rad: float = 0.0
    hardening_twist_rad: float = 0.0
    softening_twist_rad: float = 0.0
    maxwell_stiffness: float = 0.0
    maxwell_time_s: float = 1.0
    gain_m1: float = 1.0
    current_loop_time_s: float = 0.0
    delay_s: float = 0.0
    road: FloatArray = FLAT_ROAD
    road_start_m: float = 0.0
    metres_per_rad: float = 0.0
    gravity_nm: float = 0.0
    resolver_once_rad: float = 0.0
    resolver_twice_rad: float = 0.0
    resolver_once_phase_rad: float = 0.0
    resolver_twice_phase_rad: float = 0.0
