"""What moves, and what holds during one sub-step."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from estimator.compiled import inlined
from estimator.lanes import choose
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.kernel.written import several, written
from estimator.signals.record import FloatArray

ANGLE, SPEED, TWIST, LOAD_SPEED = 0, 1, 2, 3  # mechanical states that can be an output; see ``State``
LOAD_ANGLE, SHAFT_TORQUE = 20, 21  # outputs that follow from several states

VEHICLE_SPEED, BRANCH_TWIST, BRANCH_SPEED, MIDDLE_TWIST, MIDDLE_SPEED, TRACTION = 4, 5, 6, 7, 8, 9
"""Further ones."""

WITH_STATE = tuple(entry for entry in BUILT_IN.values() if entry.acting is not None and entry.acting.rate is not None)
"""The effects whose law has a state, in the order of the catalogue: so their states stand in ``State.law_states``."""

LAW_STATES = len(WITH_STATE)
"""How many there are."""

if TYPE_CHECKING:
    LawStates = tuple[float, ...]
else:  # compiled, and in C, the number of entries is a part of the type
    LawStates = tuple[(float,) * LAW_STATES]

FIRST_LAW = 10
"""Where the laws' states stand in the state array, behind the line's own."""

_LINE, _LAWS = range(FIRST_LAW), range(FIRST_LAW, FIRST_LAW + LAW_STATES)

LAGGED, LAG_RISE, FILTERED, FILTER_RISE, BRISTLES_MOTOR, BRISTLES_LOAD = range(
    FIRST_LAW + LAW_STATES, FIRST_LAW + LAW_STATES + 6
)

STATES = FIRST_LAW + LAW_STATES + 6
"""Length of the state array: ``State``, the lagged torque and its rise [Nm], the filtered reading and its [rad/s], and
``Bristles``."""

FOLLOWS = 0.3  # part of its correction with which the other end of a line follows


class State(NamedTuple):
    """Mechanical state."""

    angle: float  # of the motor [rad, rad/s]
    speed: float  # of the motor [rad/s]
    twist: float  # of the (first) shaft [rad]
    load_speed: float  # of the load, or of the wheels where the tyre slips [rad/s]
    vehicle_speed: float  # of the vehicle behind a tyre that slips, at the motor shaft [rad/s]
    branch_twist: float  # of the extra mode
    branch_speed: float  # of its inertia [rad/s]
    middle_twist: float  # twist of the second shaft [rad] and speed of the mass before it [rad/s]
    middle_speed: float  # of the mass between the shafts [rad/s]
    traction: float  # of the tyre [Nm]
    law_states: LawStates  # of the laws ``WITH_STATE``, each in the unit that its law gives it


unpacked: Callable[[FloatArray], State] = written(
    "unpacked",
    {"state": FloatArray},
    State,
    [f"return State({', '.join(f'state[{i}]' for i in _LINE)}, {several(f'state[{i}]' for i in _LAWS)})"],
    {"__name__": __name__, "State": State},
)
"""The kernel's state vector, shape (STATES,), as a named tuple."""

pack: Callable[[State, FloatArray], None] = written(
    "pack",
    {"x": State, "state": FloatArray},
    None,
    [f"state[{i}] = x[{i}]" for i in _LINE] + [f"state[{i}] = x.law_states[{i - FIRST_LAW}]" for i in _LAWS],
    {"__name__": __name__},
)
"""A named tuple into the kernel's state vector, shape (STATES,)."""


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
        x.vehicle_speed + at_load,
        x.branch_twist,
        x.branch_speed + at_motor,
        x.middle_twist,
        x.middle_speed + at_load,
        x.traction,
        x.law_states,
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
    can follow: the fastest decay [1/s] and the stiffest spring
    [Nm/rad].
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
    stiffest: float  # spring that it can follow at the lightest inertia [Nm/rad]
    tyre: Tyre  # its numbers
