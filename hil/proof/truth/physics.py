"""Physics and state of the truth: all that a driveline can hold, as tuple and array that compiled code reads.

Reflected to the motor shaft, SI units. Every effect is absent at its default.
"""

from __future__ import annotations

from enum import IntEnum
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
    friction_load_nm : float
        Dry friction on the load at any time.
    brake_nm, brake_from_s, brake_to_s, brake_period_s : float
        Dry friction on the load that is on during an interval of every period.
    quadratic_motor, quadratic_load : float
        Torque per speed squared [Nm s^2/rad^2].
    gap_rad : float
        Free play of the shaft, from contact to contact.
    hardening_twist_rad, softening_twist_rad : float
        Twist scale of a sinh (hardening) or asinh (softening) characteristic; 0 is a linear shaft.
    stiffness_step, stiffness_step_at_s, stiffness_step_rise_s : float
        Change of the shaft's stiffness over ``k`` from a moment on, and the time it takes.
    stiffness_speed_share, stiffness_speed_rad_s : float
        Change of the stiffness over ``k`` that a fast turning shaft tends to, and the speed of half of it.
    hysteresis_stiffness, hysteresis_slip_rad : float
        Shaft branch of springs in series with dry sliders: stiffness before any slides [Nm/rad], and the twist at
        which the last one does.
    maxwell_stiffness, maxwell_time_s, maxwell_fast_share : float
        Second shaft branch, spring in series with damper: stiffness [Nm/rad] and relaxation time; stiffness over it of
        a third one that relaxes faster.
    efficiency, efficiency_back : float
        Power out over power in of the gears at the shaft's driven end: while the motor drives, while the load does.
    joint_angle_rad, joint_phase_rad : float
        Bend of a Cardan joint at the driving end of the shaft, and the motor angle of its fork.
    extra_inertia, extra_stiffness, extra_damping : float
        One more inertia [kg m^2] and the spring [Nm/rad] and damper [Nm s/rad] that put it in line.
    extra_at_motor : bool
        Whether that is between motor and shaft; otherwise between shaft and load.
    gain_m1 : float
        True torque of inverter m1 over its reading.
    derating, derating_time_s : float
        Share of the torque that is lost in the end; its time constant, or 0 for a loss that grows evenly with time
        up to `TIME_TO_DERATE_S`.
    limit_m1_nm, limit_m2_nm, limit_total_nm, limit_knee : float
        What inverter m1, m2, and both together can give [Nm], 0 for no limit; the knee's sharpness.
    saturating_nm, saturating_back_nm : float
        Torque about which it grows less than its reading, forward and backward [Nm]; 0 where it does not.
    bias_nm, bias_half_s : float
        Offset of the torque that the reading comes to lack, and the time until half of it.
    slew_nm_s : float
        Fastest change of the torque [Nm/s]; 0 without a limit.
    dropout_every_s, dropout_s : float
        Time from one failure of the torque to the next, 0 for none, and how long each lasts.
    deadband_nm : float
        Reading of each inverter below which it gives no torque, and which is missing above.
    ripple_nm, ripple_share, ripple_order, ripple_phase_rad : float
        Torque periodic in the motor angle: cogging [Nm], and over the torque given; periods per turn, phase.
    current_loop_time_s : float
        Time constant of the current loop of both inverters.
    delay_s : float
        Time from the torque reading to the torque.
    generator_inertia, generator_lag : float
        Inertia that a clutch can put on the motor shaft [kg m^2], and by which share of the motor's speed it is
        slower before.
    clutch_nm, clutch_rise_s, clutch_from_s, clutch_to_s : float
        What the clutch holds when closed [Nm], the time it takes to close, and when it does and opens again.
    eddy_nm, eddy_speed_rad_s, eddy_exponent : float
        Eddy-current drag on the motor: the greatest [Nm], the speed of it, and how steeply it rises and falls.
    viscous_forward, dry_forward_nm : float
        By how much the motor's viscous [Nm s/rad] and dry friction are more forward and less backward.
    drawn_share, drawn_half_rad_s : float
        Inertia over ``J_M`` that a fast motor draws along, and the speed of half of it.
    wheel_inertia, slip_stiffness_nm, grip_nm, relaxation_rad : float
        Tyre: part of ``J_L`` that turns with the wheels [kg m^2], 0 for a tyre that can't slip; torque per slip,
        greatest torque [Nm]; motor angle over which a slip builds up.
    imbalance_nm, imbalance_twice_nm, imbalance_phase_rad, gear_ratio : float
        Torque against the load at once and twice per wheel turn [Nm], phase of it; motor turns per wheel turn.
    payload_share, payload_at_s, payload_rise_s : float
        Change of the load's inertia over ``J_L`` from a moment on, and the time it takes.
    cold_factor, warming_time_s : float
        Viscous friction of the load over ``b_L`` with cold oil, and the time constant of its warming.
    road : ndarray, shape (M, 3)
        Height profile, sum of M waves: height [m], wave number [rad/m], phase [rad].
    road_start_m, metres_per_rad, gravity_nm : float
        Where on the road the recording starts; distance per motor angle; load torque per unit of slope.
    resolver_once_rad, resolver_twice_rad, resolver_once_phase_rad, resolver_twice_phase_rad : float
        Angle error of the resolver at once and twice per turn.
    filter_time_s, filter_rad_s, filter_damping : float
        Speed filter of first order: its time constant, or of second order: its corner frequency and damping ratio.
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
    friction_load_nm: float = 0.0
    brake_nm: float = 0.0
    brake_from_s: float = 0.0
    brake_to_s: float = 0.0
    brake_period_s: float = 60.0
    quadratic_motor: float = 0.0
    quadratic_load: float = 0.0
    gap_rad: float = 0.0
    hardening_twist_rad: float = 0.0
    softening_twist_rad: float = 0.0
    stiffness_step: float = 0.0
    stiffness_step_at_s: float = 0.0
    stiffness_step_rise_s: float = 0.01
    stiffness_speed_share: float = 0.0
    stiffness_speed_rad_s: float = 1.0
    hysteresis_stiffness: float = 0.0
    hysteresis_slip_rad: float = 1.0
    maxwell_stiffness: float = 0.0
    maxwell_time_s: float = 1.0
    maxwell_fast_share: float = 0.0
    efficiency: float = 1.0
    efficiency_back: float = 1.0
    joint_angle_rad: float = 0.0
    joint_phase_rad: float = 0.0
    extra_inertia: float = 0.0
    extra_stiffness: float = 0.0
    extra_damping: float = 0.0
    extra_at_motor: bool = True
    gain_m1: float = 1.0
    derating: float = 0.0
    derating_time_s: float = 0.0
    limit_m1_nm: float = 0.0
    limit_m2_nm: float = 0.0
    limit_total_nm: float = 0.0
    limit_knee: float = 8.0
    deadband_nm: float = 0.0
    saturating_nm: float = 0.0
    saturating_back_nm: float = 0.0
    bias_nm: float = 0.0
    bias_half_s: float = 1.0
    slew_nm_s: float = 0.0
    dropout_every_s: float = 0.0
    dropout_s: float = 0.0
    ripple_nm: float = 0.0
    ripple_share: float = 0.0
    ripple_order: float = 1.0
    ripple_phase_rad: float = 0.0
    current_loop_time_s: float = 0.0
    delay_s: float = 0.0
    generator_inertia: float = 0.0
    generator_lag: float = 0.0
    clutch_nm: float = 0.0
    clutch_rise_s: float = 0.1
    clutch_from_s: float = 0.0
    clutch_to_s: float = 0.0
    eddy_nm: float = 0.0
    eddy_speed_rad_s: float = 1.0
    eddy_exponent: float = 1.0
    viscous_forward: float = 0.0
    dry_forward_nm: float = 0.0
    drawn_share: float = 0.0
    drawn_half_rad_s: float = 1.0
    wheel_inertia: float = 0.0
    slip_stiffness_nm: float = 0.0
    grip_nm: float = 1.0
    relaxation_rad: float = 1.0
    imbalance_nm: float = 0.0
    imbalance_twice_nm: float = 0.0
    imbalance_phase_rad: float = 0.0
    gear_ratio: float = 1.0
    payload_share: float = 0.0
    payload_at_s: float = 0.0
    payload_rise_s: float = 0.5
    cold_factor: float = 1.0
    warming_time_s: float = 1.0
    road: FloatArray = FLAT_ROAD
    road_start_m: float = 0.0
    metres_per_rad: float = 0.0
    gravity_nm: float = 0.0
    resolver_once_rad: float = 0.0
    resolver_twice_rad: float = 0.0
    resolver_once_phase_rad: float = 0.0
    resolver_twice_phase_rad: float = 0.0
    filter_time_s: float = 0.0
    filter_rad_s: float = 0.0
    filter_damping: float = 1.0


ELEMENTS = 8
"""Jenkins elements of a shaft with hysteresis."""


class State(IntEnum):
    """Index of each quantity: M motor, X extra inertia, L load (wheels), V vehicle, G generator.

    What is not there (CONTRACT's two masses are M and L) has its place all the same and nothing reads it. The Jenkins
    elements' deflections begin at ``SLIDERS``.
    """

    ANGLE_M = 0
    ANGLE_L = 1
    SPEED_M = 2
    SPEED_L = 3
    BRISTLE_M = 4
    BRISTLE_L = 5
    MAXWELL_NM = 6
    INVERTER_NM = 7
    TIME_S = 8
    ANGLE_X = 9
    SPEED_X = 10
    SPEED_V = 11
    SLIP = 12
    SPEED_G = 13
    FILTERED = 14
    FILTERED_RATE = 15
    MAXWELL_FAST_NM = 16
    SLIDERS = 17


SPEEDS = (State.SPEED_M, State.SPEED_X, State.SPEED_L, State.SPEED_V, State.SPEED_G, State.FILTERED)
"""All that has the speed of the whole line when it rolls as one."""

STATES = State.SLIDERS + ELEMENTS
"""Length of the state array."""
