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

    J_M: float  # inertia of the motor [kg m^2]
    J_L: float  # inertia of the load [kg m^2]
    k: float  # shaft stiffness [Nm/rad]
    c: float  # shaft damping [Nm s/rad]
    b_M: float  # viscous friction at the motor [Nm s/rad]
    b_L: float  # viscous friction at the load [Nm s/rad]
    load_torque_nm: float = 0.0  # constant torque against the load
    friction_motor_nm: float = 0.0  # dry friction on the motor shaft while it slides
    breakaway_motor_nm: float = 0.0  # the same near standstill; not above `friction_motor_nm`: it is the same there
    stribeck_speed_rad_s: float = 1.0  # speed at which the excess near standstill is down to 37 %
    friction_load_nm: float = 0.0  # dry friction on the load at any time
    brake_nm: float = 0.0  # dry friction on the load that is on during an interval of every period
    brake_from_s: float = 0.0  # when it begins to come on
    brake_to_s: float = 0.0  # when it is off again
    brake_period_s: float = 60.0  # time between two of its beginnings
    quadratic_motor: float = 0.0  # torque per speed squared at the motor [Nm s^2/rad^2]
    quadratic_load: float = 0.0  # torque per speed squared at the load [Nm s^2/rad^2]
    gap_rad: float = 0.0  # free play of the shaft, from contact to contact
    hardening_twist_rad: float = 0.0  # twist scale of a sinh characteristic; 0: it does not harden
    softening_twist_rad: float = 0.0  # twist scale of an asinh characteristic; 0: it does not soften
    stiffness_step: float = 0.0  # change of the shaft's stiffness over `k`
    stiffness_step_at_s: float = 0.0  # when it begins
    stiffness_step_rise_s: float = 0.01  # time that it takes
    stiffness_speed_share: float = 0.0  # change of the stiffness over `k` at high speed
    stiffness_speed_rad_s: float = 1.0  # speed at which half of it is there
    hysteresis_stiffness: float = 0.0  # of a shaft branch of springs in series with dry sliders [Nm/rad]
    hysteresis_slip_rad: float = 1.0  # twist at which the last of its sliders slips
    maxwell_stiffness: float = 0.0  # of a second shaft branch, spring in series with damper [Nm/rad]
    maxwell_time_s: float = 1.0  # time constant by which it relaxes
    maxwell_fast_share: float = 0.0  # a third branch's stiffness over it, which relaxes `FASTER` times as fast
    efficiency: float = 1.0  # power out over power in of the gears at the shaft's driven end, driving
    efficiency_back: float = 1.0  # the same, driven by the load
    joint_angle_rad: float = 0.0  # bend of a Cardan joint at the shaft's driving end
    joint_phase_rad: float = 0.0  # added to the angle of that end
    extra_inertia: float = 0.0  # of a third mass [kg m^2]; 0: there is none
    extra_stiffness: float = 0.0  # of the spring between it and motor, or load [Nm/rad]
    extra_damping: float = 0.0  # of that spring [Nm s/rad]
    extra_at_motor: bool = True  # whether the third mass is between motor and shaft; else between shaft and load
    gain_m1: float = 1.0  # true torque of inverter m1 over its reading
    derating: float = 0.0  # share of the torque that is lost in the end
    derating_time_s: float = 0.0  # time constant of that loss; 0: it grows evenly over a recording
    limit_m1_nm: float = 0.0  # what inverter m1 can give; 0 for no limit
    limit_m2_nm: float = 0.0  # what inverter m2 can give; 0 for no limit
    limit_total_nm: float = 0.0  # what both together can give; 0 for no limit
    limit_knee: float = 8.0  # exponent of the knee at these limits; larger is sharper
    deadband_nm: float = 0.0  # torque of each inverter below which none comes, and by which others fall short
    saturating_nm: float = 0.0  # scale S of S asinh(T / S) for a positive torque; 0: it does not saturate
    saturating_back_nm: float = 0.0  # the same for a negative torque
    bias_nm: float = 0.0  # torque beyond the reading in the end
    bias_half_s: float = 1.0  # time at which half of it is there
    slew_nm_s: float = 0.0  # fastest change of the torque [Nm/s]; 0 without a limit
    dropout_every_s: float = 0.0  # time between losses of all torque; 0: there are none
    dropout_s: float = 0.0  # how long each of them lasts
    ripple_nm: float = 0.0  # amplitude of a torque periodic in the motor angle
    ripple_share: float = 0.0  # the same over the torque
    ripple_order: float = 1.0  # periods per turn of the motor
    ripple_phase_rad: float = 0.0  # at angle 0
    current_loop_time_s: float = 0.0  # time constant of the current loop of both inverters
    delay_s: float = 0.0  # time from the torque reading to the torque
    generator_inertia: float = 0.0  # that the clutch couples to the motor [kg m^2]; 0: there is none
    generator_lag: float = 0.0  # share of the motor's speed by which it is slower with the clutch open
    clutch_nm: float = 0.0  # largest torque through the closed clutch
    clutch_rise_s: float = 0.1  # time that it takes to close
    clutch_from_s: float = 0.0  # when it begins to close
    clutch_to_s: float = 0.0  # when it begins to open
    eddy_nm: float = 0.0  # greatest eddy-current drag on the motor
    eddy_speed_rad_s: float = 1.0  # speed at which it is greatest
    eddy_exponent: float = 1.0  # of the speed; 1 without the skin effect
    viscous_forward: float = 0.0  # friction at the motor more forward, and less backward [Nm s/rad]
    dry_forward_nm: float = 0.0  # the same of its dry friction
    drawn_share: float = 0.0  # inertia over ``J_M`` that a fast motor draws along
    drawn_half_rad_s: float = 1.0  # speed at which half of it is drawn along
    wheel_inertia: float = 0.0  # part of ``J_L`` that is the wheels' [kg m^2]; 0: the tyre does not slip
    slip_stiffness_nm: float = 0.0  # torque per slip, for small slip
    grip_nm: float = 1.0  # largest torque of the tyres
    relaxation_rad: float = 1.0  # way in which the slip builds up, as angle of the motor shaft
    imbalance_nm: float = 0.0  # torque against the load once per wheel turn
    imbalance_twice_nm: float = 0.0  # the same twice per wheel turn
    imbalance_phase_rad: float = 0.0  # angle of the wheel at the beginning
    gear_ratio: float = 1.0  # motor turns per wheel turn
    payload_share: float = 0.0  # change of the load's inertia over ``J_L``
    payload_at_s: float = 0.0  # when it begins
    payload_rise_s: float = 0.5  # time that it takes
    cold_factor: float = 1.0  # viscous friction at the load over ``b_L`` at the beginning
    warming_time_s: float = 1.0  # time constant of the oil's temperature
    road: FloatArray = FLAT_ROAD  # (M, 3): Height profile, sum of M waves
    road_start_m: float = 0.0  # where on the road the recording starts
    metres_per_rad: float = 0.0  # distance driven per radian of the motor
    gravity_nm: float = 0.0  # load torque per unit of slope
    resolver_once_rad: float = 0.0  # angle error of the resolver, once per turn
    resolver_twice_rad: float = 0.0  # the same twice per turn
    resolver_once_phase_rad: float = 0.0  # of the first, at motor angle 0
    resolver_twice_phase_rad: float = 0.0  # of the second, at motor angle 0
    filter_time_s: float = 0.0  # time constant of a speed filter of first order; 0: there is none
    filter_rad_s: float = 0.0  # corner of a speed filter of second order; 0: there is none
    filter_damping: float = 1.0  # damping ratio of that filter


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
