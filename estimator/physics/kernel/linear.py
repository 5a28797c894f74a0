"""Of a linear line, where a stretch of time leads to: read off the Runge-Kutta steps once, then only added up."""

from __future__ import annotations

import numpy as np

from estimator.compiled import inlined
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.kernel.conditions import Line, is_bristled, is_bristled_at_motor, with_friction, with_torques
from estimator.physics.kernel.laws_at import (
    has_dry_friction_at_load,
    has_dry_friction_at_motor,
    motor_sliding,
    no_states,
)
from estimator.physics.kernel.rates import advanced, dry_at_load, runge_kutta, stepped
from estimator.physics.kernel.state_vector import (
    ANGLE,
    BRANCH_SPEED,
    BRANCH_TWIST,
    FIRST_LAW,
    LAW_STATES,
    LOAD_SPEED,
    MIDDLE_SPEED,
    MIDDLE_TWIST,
    SPEED,
    TWIST,
    Conditions,
    State,
    pack,
    unpacked,
)
from estimator.physics.laws import BEYOND, dry_friction
from estimator.physics.layout import slot
from estimator.physics.tables import TABLES
from estimator.signals.record import FloatArray

FED_OR_LOADED = ("table_torque", "table_load_angle")  # curves that change a torque from outside, and no line

TO_TORQUE, TO_RISE, TO_LOAD = range(FIRST_LAW + LAW_STATES, FIRST_LAW + LAW_STATES + 3)
"""Rows of the responses to a torque, behind those to the entries of the state."""

RESPONSES = TO_LOAD + 1
"""How many there are."""

WORTHWHILE_SAMPLES = 50  # samples from which on working the responses out takes less time than they save

_OTHERS = [(entry.name, each) for entry in BUILT_IN.values() if not entry.linear for each in entry.parameters]
_OTHERS += [(entry.name, entry.parameters[0]) for entry in TABLES.values() if entry.name not in FED_OR_LOADED]
BENDING = np.array([slot(effect, parameter.name) for effect, parameter in _OTHERS])
NULLS = np.array([parameter.null for _, parameter in _OTHERS])
"""Where the parameters of all effects stand that leave no line linear, and what each is where its effect is not there:
with one of them a line takes its sub-steps."""


@inlined
def is_linear(line: Line, p: FloatArray) -> bool:
    """Tell whether a line is linear while its conditions are constant and dry friction has its full size.

    Bristles leave it linear at any speed: what they hold is a torque like another.
    """
    falls = not is_bristled_at_motor(p) and motor_sliding(0.0, p) != motor_sliding(np.inf, p)
    if len(line.own) > 0 or not line.elastic or falls:
        return False
    for i in range(BENDING.size):
        if p[BENDING[i]] != NULLS[i]:
            return False
    return True


@inlined
def has_dry_friction(p: FloatArray) -> bool:
    """Tell whether a parameter of dry friction is not at its null."""
    return is_bristled(p) or has_dry_friction_at_motor(p) or has_dry_friction_at_load(p)


@inlined
def kept_friction(line: Line, now: Conditions, before: State, after: State) -> bool:
    """Tell whether dry friction, where there is any, had its full size in one direction from one state to the next."""
    begun, ended = before.speed, after.speed
    motor = now.dry_motor == 0.0 or is_beyond(begun, ended, BEYOND * now.width_motor)
    if line.masses > 1:
        begun, ended = before.load_speed, after.load_speed
    return motor and (now.dry_load == 0.0 or is_beyond(begun, ended, BEYOND * now.width_load))


@inlined
def is_beyond(begun: float, ended: float, limit: float) -> bool:
    """Tell whether two speeds are further from zero than a limit, on the same side of it."""
    return min(begun, ended) > limit or max(begun, ended) < -limit


@inlined
def fill_responses(line: Line, now: Conditions, p: FloatArray, h: float, steps: int, to: FloatArray) -> None:
    """Fill to which state ``steps`` sub-steps of ``h`` [s] lead a line at rest, shape (RESPONSES, STATES).

    A row for a unit of each entry of the state, and of each torque [Nm]: at the motor, one that rises from 0 over the
    step, and at the load. Without dry friction.
    """
    now = with_friction(now, 0.0, 0.0, 0.0, 0.0, 0.0)
    for row in range(RESPONSES):
        to[row] = 0.0
        if row < TO_TORQUE:
            to[row, row] = 1.0
        felt = with_torques(now, 0.0, 1.0 if row == TO_LOAD else 0.0)
        torque, rise = 1.0 if row == TO_TORQUE else 0.0, 1.0 if row == TO_RISE else 0.0
        x = unpacked(to[row])
        for _ in range(steps):
            x = runge_kutta(line, felt, torque, rise, x, p, h)
        pack(x, to[row])


@inlined
def next_linear_state(
    line: Line,
    summing: bool,
    to: FloatArray,
    now: Conditions,
    torque: float,
    rise: float,
    x: State,
    p: FloatArray,
    h: float,
) -> State:
    """Return the state that follows on ``x``: the sum of responses where that is asked for and right, else a step."""
    if summing:
        after = summed(line, to, now, torque, rise, x, p)
        if kept_friction(line, now, x, after):
            return after
    return stepped(line, now, torque, rise, x, p, h)


@inlined
def summed(line: Line, to: FloatArray, now: Conditions, torque: float, rise: float, x: State, p: FloatArray) -> State:
    """Return the state that follows on ``x`` under a torque of this mean and rise [Nm] and full dry friction."""
    carried = x.speed if line.masses == 1 else x.load_speed
    torque += now.torque
    if now.dry_motor != 0.0:
        torque -= dry_friction(x.speed, now.dry_motor, now.width_motor)
    load = now.load + dry_at_load(carried, now)
    after = State(0.0, 0.0, 0.0, 0.0, x.vehicle_speed, 0.0, 0.0, 0.0, 0.0, x.traction, no_states(0.0))
    after = advanced(line, after, unpacked(to[TO_TORQUE]), torque)
    after = advanced(line, after, unpacked(to[TO_LOAD]), load)
    if rise != 0.0:
        after = advanced(line, after, unpacked(to[TO_RISE]), rise)
    after = advanced(line, after, unpacked(to[ANGLE]), x.angle)
    after = advanced(line, after, unpacked(to[SPEED]), x.speed)
    if line.masses > 1:
        after = advanced(line, after, unpacked(to[TWIST]), x.twist)
        after = advanced(line, after, unpacked(to[LOAD_SPEED]), x.load_speed)
    if line.masses == 3:
        after = advanced(line, after, unpacked(to[MIDDLE_TWIST]), x.middle_twist)
        after = advanced(line, after, unpacked(to[MIDDLE_SPEED]), x.middle_speed)
    if line.extended:
        after = advanced(line, after, unpacked(to[BRANCH_TWIST]), x.branch_twist)
        after = advanced(line, after, unpacked(to[BRANCH_SPEED]), x.branch_speed)
        for i in range(LAW_STATES):
            after = advanced(line, after, unpacked(to[FIRST_LAW + i]), x.law_states[i])
    return after
