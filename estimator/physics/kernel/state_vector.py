"""What moves, and what holds during one sub-step."""

from __future__ import annotations

from typing import NamedTuple

from estimator.compiled import inlined
from estimator.lanes import choose
from estimator.signals.record import FloatArray

ANGLE, SPEED, TWIST, LOAD_SPEED = 0, 1, 2, 3  # mechanical states that can be an output; see ``State``
LOAD_ANGLE, SHAFT_TORQUE = 20, 21  # outputs that follow from several states

VEHICLE_SPEED, BRANCH_TWIST, BRANCH_SPEED, MIDDLE_TWIST, MIDDLE_SPEED, TRACTION = 5, 6, 7, 8, 9, 10
"""Further ones."""

STATES = 18
"""Length of the state array: ``State``, the lagged torque and its rise [Nm], the filtered reading and its [rad/s], and
``Bristles``."""

RELAXING, LAGGED, LAG_RISE, FILTERED, FILTER_RISE, BRISTLES_MOTOR, BRISTLES_LOAD = 11, 12, 13, 14, 15, 16, 17

FOLLOWS = 0.3  # part of its correction with which the other end of a line follows


class State(NamedTuple):
    """Mechanical state."""

    angle: float  # of the motor [rad, rad/s]
    speed: float  # of the motor [rad/s]
    twist: float  # of the (first) shaft [rad]
    load_speed: float  # of the load, or of the wheels where the tyre slips [rad/s]
    loading: float  # of the shaft's slider, from -1 to 1
    vehicle_speed: float  # of the vehicle behind a tyre that slips, at the motor shaft [rad/s]
    branch_twist: float  # of the extra mode
    branch_speed: float  # of its inertia [rad/s]
    middle_twist: float  # twist of the second shaft [rad] and speed of the mass before it [rad/s]
    middle_speed: float  # of the mass between the shafts [rad/s]
    traction: float  # of the tyre [Nm]
    relaxing: float  # torque of the branch in the first shaft that relaxes [Nm]


@inlined
def unpacked(state: FloatArray) -> State:
    """Return the kernel's state vector as a named tuple."""
    return State(
        state[0], state[1], state[2], state[3], state[4], state[5],
        state[6], state[7], state[8], state[9], state[10], state[11],
    )  # fmt: skip


@inlined
def corrected(x: State, error: float, output: int) -> State:
    """Return a state that an observer has moved by an error of a speed [rad/s]; of no other output."""
    at_motor = choose(output == SPEED, 1.0, FOLLOWS) * error
    at_load = choose(output == LOAD_SPEED, 1.0, FOLLOWS) * error
    if output != SPEED and output != LOAD_SPEED:
        return x
    return State(
        x.angle,
        x.speed + at_motor,
        x.twist,
        x.load_speed + at_load,
        x.loading,
        x.vehicle_speed + at_load,
        x.branch_twist,
        x.branch_speed + at_motor,
        x.middle_twist,
        x.middle_speed + at_load,
        x.traction,
        x.relaxing,
    )


class Bristles(NamedTuple):
    """Torques that the bent bristles of dry friction hold at the motor and at the load [Nm]."""

    motor: float  # at the motor [Nm]
    load: float  # at the load, or at the wheels of a tyre that slips [Nm]


class Tyre(NamedTuple):
    """What the law of a tyre takes from its parameters; inverses, because a division takes as long as a law."""

    tread: float  # torque per slip [Nm]
    least_relaxation: float  # shortest angle of relaxation that the step can follow [rad]
    winding: float  # torque per rate at which the carcass winds up, no more than the step can follow [Nm s/rad]
    inverse_creep: float  # of the speed that a slip is at least a share of [s/rad]
    inverse_grip: float  # of the largest traction [1/Nm]
    inverse_wheel: float  # of the wheels' inertia [1/(kg m^2)]
    inverse_vehicle: float  # of the vehicle's [1/(kg m^2)]


class Conditions(NamedTuple):
    """What holds during one sub-step: torques [Nm], inertias, stiffness, friction, widths of a sign change [rad/s].

    ``rubbing`` is the torque of the bristles at the load, or at the wheels of a tyre that slips [Nm]. And what the step
    can follow: the fastest decay [1/s] and, as an inverse [1/rad], the shortest twist over which friction inside the
    shaft yields.
    """

    torque: float  # at the motor [Nm]
    load: float  # at the load [Nm]
    rubbing: float
    torque_factor: float  # on the torque at the motor
    shaft_extra: float  # torque added to the shaft's [Nm]
    shaft_factor: float  # on the shaft's torque
    joint_angle: float  # imposed twist of a joint [rad]
    joint_rate: float  # its rate [rad/s]
    inverse_motor: float  # of the motor's inertia [1/(kg m^2)]
    inertia_load: float  # of the load [kg m^2]
    inverse_load: float  # its inverse
    stiffness: float  # of the first shaft [Nm/rad]
    viscous_load: float  # friction at the load [Nm s/rad]
    dry_motor: float  # dry friction at the motor [Nm]
    dry_load: float  # at the load [Nm]
    width_motor: float  # speed over which its sign changes [rad/s]
    width_load: float  # the same at the load [rad/s]
    branch_inertia: float  # of the extra mode [kg m^2]; 0 without
    branch_frequency: float  # its own [rad/s]
    fastest: float  # decay that the step has to follow [1/s]
    inverse_yield: float  # of the twist over which friction in the shaft yields [1/rad]
    tyre: Tyre  # its numbers
