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


class State(NamedTuple):
    """Mechanical state."""

    angle: float  # of the motor [rad, rad/s]
    speed: float
    twist: float  # of the (first) shaft [rad]
    load_speed: float  # of the load, or of the wheels where the tyre slips [rad/s]
    loading: float  # of the shaft's slider, from -1 to 1
    vehicle_speed: float
    branch_twist: float  # of the extra mode
    branch_speed: float
    middle_twist: float  # twist of the second shaft [rad] and speed of the mass before it [rad/s]
    middle_speed: float
    traction: float
    relaxing: float  # torque of the branch in the first shaft that relaxes [Nm]


@inlined
def unpacked(state: FloatArray) -> State:
    return State(
        state[0], state[1], state[2], state[3], state[4], state[5],
        state[6], state[7], state[8], state[9], state[10], state[11],
    )  # fmt: skip


FOLLOWS = 0.3  # part of its correction with which the other end of a line follows


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

    motor: float
    load: float


class Tyre(NamedTuple):
    """What the law of a tyre takes from its parameters; inverses, because a division takes as long as a law."""

    tread: float  # torque per slip [Nm]
    least_relaxation: float
    winding: float
    inverse_creep: float
    inverse_grip: float
    inverse_wheel: float
    inverse_vehicle: float


class Conditions(NamedTuple):
    """What holds during one sub-step: torques [Nm], inertias, stiffness, friction, widths of a sign change [rad/s].

    ``rubbing`` is the torque of the bristles at the load, or at the wheels of a tyre that slips [Nm]. And what the step
    can follow: the fastest decay [1/s] and, as an inverse [1/rad], the shortest twist over which friction inside the
    shaft yields.
    """

    torque: float
    load: float
    rubbing: float
    torque_factor: float
    shaft_extra: float
    shaft_factor: float
    joint_angle: float
    joint_rate: float
    inverse_motor: float
    inertia_load: float
    inverse_load: float
    stiffness: float
    viscous_load: float
    dry_motor: float
    dry_load: float
    width_motor: float
    width_load: float
    branch_inertia: float
    branch_frequency: float
    fastest: float
    inverse_yield: float
    tyre: Tyre
