"""From the state to what is recorded of it."""

from __future__ import annotations

from estimator.compiled import inlined
from estimator.physics.effects.sensor import resolver_error
from estimator.physics.effects.timing import LowPass, filter_step
from estimator.physics.kernel import slots
from estimator.physics.kernel.conditions import is_within
from estimator.physics.kernel.laws_at import recorded, resolved
from estimator.physics.kernel.state_vector import LOAD_ANGLE, LOAD_SPEED, SPEED, TWIST, State
from estimator.signals.record import FloatArray


@inlined
def angle_at_load(x: State, p: FloatArray) -> float:
    """Return the angle of the load [rad]."""
    return x.angle - x.twist - x.middle_twist - (x.branch_twist if is_within(p) else 0.0)


@inlined
def entry(x: State, output: int, p: FloatArray) -> float:
    """Return what is an output of the state alone: all but SHAFT_TORQUE, which is 0."""
    if output == SPEED:
        return x.speed
    if output == LOAD_SPEED:
        return x.load_speed
    if output == LOAD_ANGLE:
        return angle_at_load(x, p)
    return x.twist if output == TWIST else x.angle


@inlined
def travelled(x: State, output: int, p: FloatArray) -> float:
    """Return the angle whose rate is the output [rad]: what a filter's input has been in the mean is its change."""
    if output == SPEED:
        return x.angle
    return angle_at_load(x, p)


@inlined
def read_angle(angle: float, p: FloatArray) -> float:
    """Return the angle that the resolver gives at a motor angle [rad]."""
    once, twice = p[slots.RESOLVER_ONCE], p[slots.RESOLVER_TWICE]
    return angle + resolver_error(angle, once, p[slots.RESOLVER_ONCE_PHASE], twice, p[slots.RESOLVER_TWICE_PHASE])


@inlined
def smoothed(
    before: State,
    after: State,
    output: int,
    angle_before: float,
    angle_after: float,
    filtered: float,
    rise: float,
    low: LowPass,
    p: FloatArray,
    h: float,
) -> tuple[float, float]:
    """Return the filtered reading and its rise [rad/s] after a step of ``h`` [s] between two states and read angles."""
    begin, end = entry(before, output, p), entry(after, output, p)
    bow = travelled(after, output, p) / h - travelled(before, output, p) / h - 0.5 * (begin + end)
    read, ends = resolved(begin + bow, angle_before, p), resolved(end + bow, angle_after, p)
    return filter_step(read, ends, filtered, rise, low, h)


@inlined
def shown(speed: float, angle: float, filtered: float, p: FloatArray) -> float:
    """Return what is recorded of a speed [rad/s] where an angle is read [rad]: filtered, and as the sensor has it."""
    return recorded(filtered if p[slots.FILTER] > 0.0 else resolved(speed, angle, p), p)
