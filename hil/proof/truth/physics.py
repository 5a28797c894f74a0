"""Physics and state of the truth: all that a driveline can hold, as tuple and array that compiled code reads.

Reflected to the motor shaft, SI units. Every effect is absent at its default.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FLAT_ROAD: FloatArray = np.zeros((0, 3))  # a height profile without hills

ELEMENTS = 8  # Jenkins elements of a shaft with hysteresis


class Physics(NamedTuple):
    """A driveline with all it may hide."""

    J_M: float  # inertia of motor and load [kg m^2]
    J_L: float  # inertia of motor and load [kg m^2]
    k: float  # shaft stiffness [Nm/rad] and damping [Nm s/rad]
    c: float  # shaft stiffness [Nm/rad] and damping [Nm s/rad]
    b_M: float  # viscous friction [Nm s/rad]
    b_L: float  # viscous friction [Nm s/rad]
    load_torque_nm: float = 0.0  # constant torque against the load
    friction_motor_nm: float = 0.0  # dry friction on the motor shaft
    breakaway_motor_nm: float = 0.0  # dry friction on the motor shaft
    stribeck_speed_rad_s: float = 1.0  # dry friction on the motor shaft
    friction_load_nm: float = 0.0  # dry friction on the load at any time
    brake_nm: float = 0.0  # dry friction on the load that is on during an interval of every period
    brake_from_s: float = 0.0  # dry friction on the load that is on during an interval of every period
    brake_to_s: float = 0.0  # dry friction on the load that is on during an interval of every period
    brake_period_s: float = 60.0  # dry friction on the load that is on during an interval of every period
    quadratic_motor: float = 0.0  # torque per speed squared [Nm s^2/rad^2]
    quadratic_load: float = 0.0  # torque per speed squared [Nm s^2/rad^2]
    gap_rad: float = 0.0  # free play of the shaft, from contact to contact
    hardening_twist_rad: float = 0.0  # twist scale of a sinh (hardening) or asinh (softening) characteristic
    softening_twist_rad: float = 0.0  # twist scale of a sinh (hardening) or asinh (softening) characteristic
    stiffness_step: float = 0.0
    stiffness_step_at_s: float = 0.0
    stiffness_step_rise_s: float = 0.01
    stiffness_speed_share: float = 0.0
    stiffness_speed_rad_s: float = 1.0
    hysteresis_stiffness: float = 0.0  # shaft branch of springs in series with dry sliders
    hysteresis_slip_rad: float = 1.0  # shaft branch of springs in series with dry sliders
    maxwell_stiffness: float = 0.0  # second shaft branch, spring in series with damper
    maxwell_time_s: float = 1.0  # second shaft branch, spring in series with damper
    maxwell_fast_share: float = 0.0  # second shaft branch, spring in series with damper
    efficiency: float = 1.0  # power out over power in of the gears at the shaft's driven end
    efficiency_back: float = 1.0  # power out over power in of the gears at the shaft's driven end
    joint_angle_rad: float = 0.0
    joint_phase_rad: float = 0.0
    extra_inertia: float = 0.0
    extra_stiffness: float = 0.0
    extra_damping: float = 0.0
    extra_at_motor: bool = True  # whether that is between motor and shaft
    gain_m1: float = 1.0  # true torque of inverter m1 over its reading
    derating: float = 0.0  # share of the torque that is lost in the end
    derating_time_s: float = 0.0  # share of the torque that is lost in the end
    limit_m1_nm: float = 0.0  # what inverter m1, m2, and both together can give [Nm], 0 for no limit
    limit_m2_nm: float = 0.0  # what inverter m1, m2, and both together can give [Nm], 0 for no limit
    limit_total_nm: float = 0.0  # what inverter m1, m2, and both together can give [Nm], 0 for no limit
    limit_knee: float = 8.0  # what inverter m1, m2, and both together can give [Nm], 0 for no limit
    deadband_nm: float = 0.0
    saturating_nm: float = 0.0
    saturating_back_nm: float = 0.0
    bias_nm: float = 0.0
    bias_half_s: float = 1.0
    slew_nm_s: float = 0.0  # fastest change of the torque [Nm/s]; 0 without a limit
    dropout_every_s: float = 0.0
    dropout_s: float = 0.0
    ripple_nm: float = 0.0  # torque periodic in the motor angle
    ripple_share: float = 0.0  # torque periodic in the motor angle
    ripple_order: float = 1.0  # torque periodic in the motor angle
    ripple_phase_rad: float = 0.0  # torque periodic in the motor angle
    current_loop_time_s: float = 0.0  # time constant of the current loop of both inverters
    delay_s: float = 0.0  # time from the torque reading to the torque
    generator_inertia: float = 0.0
    generator_lag: float = 0.0
    clutch_nm: float = 0.0
    clutch_rise_s: float = 0.1
    clutch_from_s: float = 0.0
    clutch_to_s: float = 0.0
    eddy_nm: float = 0.0  # eddy-current drag on the motor
    eddy_speed_rad_s: float = 1.0  # eddy-current drag on the motor
    eddy_exponent: float = 1.0  # eddy-current drag on the motor
    viscous_forward: float = 0.0
    dry_forward_nm: float = 0.0
    drawn_share: float = 0.0  # inertia over ``J_M`` that a fast motor draws along, and the speed of half of it
    drawn_half_rad_s: float = 1.0  # inertia over ``J_M`` that a fast motor draws along, and the speed of half of it
    wheel_inertia: float = 0.0  # tyre
    slip_stiffness_nm: float = 0.0  # tyre
    grip_nm: float = 1.0  # tyre
    relaxation_rad: float = 1.0  # tyre
    imbalance_nm: float = 0.0  # torque against the load at once and twice per wheel turn [Nm], phase of it
    imbalance_twice_nm: float = 0.0  # torque against the load at once and twice per wheel turn [Nm], phase of it
    imbalance_phase_rad: float = 0.0  # torque against the load at once and twice per wheel turn [Nm], phase of it
    gear_ratio: float = 1.0  # torque against the load at once and twice per wheel turn [Nm], phase of it
    payload_share: float = 0.0
    payload_at_s: float = 0.0
    payload_rise_s: float = 0.5
    cold_factor: float = 1.0
    warming_time_s: float = 1.0
    road: FloatArray = FLAT_ROAD  # (M, 3): Height profile, sum of M waves
    road_start_m: float = 0.0  # where on the road the recording starts
    metres_per_rad: float = 0.0  # where on the road the recording starts
    gravity_nm: float = 0.0  # where on the road the recording starts
    resolver_once_rad: float = 0.0  # angle error of the resolver at once and twice per turn
    resolver_twice_rad: float = 0.0  # angle error of the resolver at once and twice per turn
    resolver_once_phase_rad: float = 0.0  # angle error of the resolver at once and twice per turn
    resolver_twice_phase_rad: float = 0.0  # angle error of the resolver at once and twice per turn
    filter_time_s: float = 0.0  # speed filter of first order
    filter_rad_s: float = 0.0  # speed filter of first order
    filter_damping: float = 1.0  # speed filter of first order


class StateIndex(IntEnum):
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


SPEEDS = (
    StateIndex.SPEED_M,
    StateIndex.SPEED_X,
    StateIndex.SPEED_L,
    StateIndex.SPEED_V,
    StateIndex.SPEED_G,
    StateIndex.FILTERED,
)
"""All that has the speed of the whole line when it rolls as one."""

STATES = StateIndex.SLIDERS + ELEMENTS  # length of the state array
