"""Of a linear line, where a stretch of time leads to: read off the Runge-Kutta steps once, then only added up."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from estimator.compiled import compiled, inlined
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
    STATES,
    TWIST,
    Conditions,
    State,
    unpacked,
)
from estimator.physics.kernel.written import several, written
from estimator.physics.laws import BEYOND, dry_friction
from estimator.physics.layout import slot
from estimator.physics.tables import TABLES
from estimator.signals.record import FloatArray

FED_OR_LOADED = ("table_torque", "table_load_angle")  # curves that change a torque from outside, and no line

NONE = -1  # no entry of the state

WORTHWHILE_SAMPLES = 50  # samples from which on reading the answers takes less time than they save

_OTHERS = [(entry.name, each) for entry in BUILT_IN.values() if not entry.linear for each in entry.parameters]
_OTHERS += [(entry.name, entry.parameters[0]) for entry in TABLES.values() if entry.name not in FED_OR_LOADED]
BENDING = np.array([slot(effect, parameter.name) for effect, parameter in _OTHERS])
NULLS = np.array([parameter.null for _, parameter in _OTHERS])
"""Where the parameters of all effects stand that leave no line linear, and what each is where its effect is not there:
with one of them a line takes its sub-steps."""


class StepResponses(NamedTuple):
    """The state to which a unit of each entry of the state, and of each torque, leads a line at rest."""

    angle: State  # to one unit of the entry of that name [unit of the state / unit of the entry]
    speed: State  # to a unit of the motor's speed
    twist: State  # ... of the first shaft's twist
    load_speed: State  # ... of the load's speed
    branch_twist: State  # ... of the extra mode's twist
    branch_speed: State  # ... and speed
    middle_twist: State  # ... of the second shaft's twist
    middle_speed: State  # ... of the middle mass's speed
    torque: State  # to 1 Nm at the motor over the whole step
    rise: State  # to a torque that rises from 0 to 1 Nm over the step
    load: State  # to 1 Nm at the load over the whole step
    law_states: tuple[State, ...]  # to a unit of each law's own state


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
def unit(entry: int) -> State:
    """Return the state whose entry of this number is 1 and whose others are 0; no entry: that at rest."""
    state = np.zeros(STATES)
    if entry >= 0:
        state[entry] = 1.0
    return unpacked(state)


@compiled
def answers(line: Line, now: Conditions, p: FloatArray, h: float, steps: int) -> StepResponses:
    """Return what ``steps`` sub-steps of ``h`` [s] make of each unit of a state and a torque, without dry friction."""
    now = with_friction(now, 0.0, 0.0, 0.0, 0.0, 0.0)
    pulled = with_torques(now, 0.0, 1.0)
    return StepResponses(
        after(line, now, 0.0, 0.0, unit(ANGLE), p, h, steps),
        after(line, now, 0.0, 0.0, unit(SPEED), p, h, steps),
        after(line, now, 0.0, 0.0, unit(TWIST), p, h, steps),
        after(line, now, 0.0, 0.0, unit(LOAD_SPEED), p, h, steps),
        after(line, now, 0.0, 0.0, unit(BRANCH_TWIST), p, h, steps),
        after(line, now, 0.0, 0.0, unit(BRANCH_SPEED), p, h, steps),
        after(line, now, 0.0, 0.0, unit(MIDDLE_TWIST), p, h, steps),
        after(line, now, 0.0, 0.0, unit(MIDDLE_SPEED), p, h, steps),
        after(line, now, 1.0, 0.0, unit(NONE), p, h, steps),
        after(line, now, 0.0, 1.0, unit(NONE), p, h, steps),
        after(line, pulled, 0.0, 0.0, unit(NONE), p, h, steps),
        of_law_states(line, now, p, h, steps),
    )


@compiled
def after(
    line: Line, now: Conditions, torque: float, rise: float, x: State, p: FloatArray, h: float, steps: int
) -> State:
    """Return the state after ``steps`` sub-steps of ``h`` [s] under one torque of this mean and rise [Nm]."""
    for _ in range(steps):
        x = runge_kutta(line, now, torque, rise, x, p, h)
    return x


of_law_states: Callable[..., tuple[State, ...]] = written(
    "of_law_states",
    {"line": Line, "now": Conditions, "p": FloatArray, "h": float, "steps": int},
    tuple[State, ...],
    [f"return {several(f'after(line, now, 0.0, 0.0, unit({FIRST_LAW + i}), p, h, steps)' for i in range(LAW_STATES))}"],
    {"__name__": __name__, "after": after, "unit": unit},
)
"""What ``steps`` sub-steps of ``h`` [s] make of a unit of each law's own state."""


@inlined
def next_linear_state(
    line: Line,
    summing: bool,
    to: StepResponses,
    now: Conditions,
    torque: float,
    rise: float,
    x: State,
    p: FloatArray,
    h: float,
) -> State:
    """Return the state that follows on ``x``: the sum of the answers where that is asked for and right, else a step."""
    if summing:
        after = answered(line, to, now, torque, rise, x, p)
        if kept_friction(line, now, x, after):
            return after
    return stepped(line, now, torque, rise, x, p, h)


@inlined
def answered(
    line: Line, to: StepResponses, now: Conditions, torque: float, rise: float, x: State, p: FloatArray
) -> State:
    """Return the state that follows on ``x`` under a torque of this mean and rise [Nm] and full dry friction."""
    carried = x.speed if line.masses == 1 else x.load_speed
    torque += now.torque
    if now.dry_motor != 0.0:
        torque -= dry_friction(x.speed, now.dry_motor, now.width_motor)
    load = now.load + dry_at_load(carried, now)
    after = State(0.0, 0.0, 0.0, 0.0, x.vehicle_speed, 0.0, 0.0, 0.0, 0.0, x.traction, no_states(0.0))
    after = advanced(line, after, to.torque, torque)
    after = advanced(line, after, to.load, load)
    if rise != 0.0:
        after = advanced(line, after, to.rise, rise)
    after = advanced(line, after, to.angle, x.angle)
    after = advanced(line, after, to.speed, x.speed)
    if line.masses > 1:
        after = advanced(line, after, to.twist, x.twist)
        after = advanced(line, after, to.load_speed, x.load_speed)
    if line.masses == 3:
        after = advanced(line, after, to.middle_twist, x.middle_twist)
        after = advanced(line, after, to.middle_speed, x.middle_speed)
    if line.extended:
        after = advanced(line, after, to.branch_twist, x.branch_twist)
        after = advanced(line, after, to.branch_speed, x.branch_speed)
        for i in range(LAW_STATES):
            after = advanced(line, after, to.law_states[i], x.law_states[i])
    return after
