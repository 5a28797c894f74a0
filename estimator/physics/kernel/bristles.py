"""Dry friction whose bristles bend before they slide, at the motor and at the load.

A contact under friction is a spring until it breaks away; sliding, it follows the Stribeck curve ``g``, behind by a
distance and not by a time::

    dT_f/dt = s (w - |w| T_f / g(w)),    s = (T_c + T_x) / x_b
"""

from __future__ import annotations

from estimator.compiled import inlined
from estimator.lanes import choose, like, some
from estimator.physics.kernel import slots
from estimator.physics.kernel.conditions import Line, is_bristled_at_load, is_bristled_at_motor, with_friction
from estimator.physics.kernel.state_vector import Bristles, Conditions, State
from estimator.physics.laws import LEAST, fading
from estimator.signals.record import FloatArray


@inlined
def breakaway(p: FloatArray) -> float:
    """Return the dry friction of all laws at the motor, next to standstill [Nm]."""
    return float(p[slots.COULOMB] + p[slots.STRIBECK_COULOMB] + p[slots.STRIBECK])


@inlined
def sliding(speed: float, p: FloatArray) -> float:
    """Return what they come to while it slides at a speed [Nm]."""
    ratio = speed / max(p[slots.STRIBECK_SPEED], LEAST)
    torque: float = p[slots.COULOMB] + p[slots.STRIBECK_COULOMB] + p[slots.STRIBECK] * fading(ratio * ratio)
    return torque


@inlined
def slid(speed: float, limit: float) -> float:
    """Return the torque against a motion that has continued for long under a friction [Nm]."""
    return choose(speed > 0.0, limit, choose(speed < 0.0, -limit, 0.0))


@inlined
def followed(torque: float, speed: float, limit: float, stiffness: float, time_s: float) -> float:
    """Return the torque of bristles of a stiffness [Nm/rad] after a time at constant speed [Nm]."""
    left = fading(abs(speed) * stiffness * time_s / max(limit, LEAST))
    return slid(speed, limit) * (1.0 - left) + torque * left


@inlined
def at_motor(torque: float, x: State, now: Conditions, p: FloatArray, time_s: float) -> float:
    """Return the torque of the motor's bristles after a time at the speed of a state [Nm].

    Their stiffness is none that the step can't follow.
    """
    stiff = breakaway(p) / max(p[slots.COULOMB_PRESLIDING], p[slots.STRIBECK_PRESLIDING])
    stiff = min(stiff, now.fastest * now.fastest / now.inverse_motor)
    return followed(torque, x.speed, sliding(x.speed, p), stiff, time_s)


@inlined
def at_load(line: Line, torque: float, x: State, now: Conditions, p: FloatArray, time_s: float) -> float:
    speed, inverse_inertia = x.load_speed, now.inverse_load
    if line.masses == 1:
        speed, inverse_inertia = x.speed, now.inverse_motor
    elif line.extended and some(p[slots.SLIP] > 0.0):
        inverse_inertia = now.tyre.inverse_wheel
    limit = now.dry_load
    stiff = limit / max(p[slots.COULOMB_LOAD_PRESLIDING], p[slots.BRAKE_PRESLIDING])
    stiff = min(stiff, now.fastest * now.fastest / inverse_inertia)
    return followed(min(max(torque, -limit), limit), speed, limit, stiff, time_s)


@inlined
def bent(line: Line, held: Bristles, x: State, now: Conditions, p: FloatArray, time_s: float) -> Bristles:
    """Return what the bristles hold after a time at the speeds of a state."""
    motor, load = held.motor, held.load
    if is_bristled_at_motor(p):
        motor = at_motor(motor, x, now, p, time_s)
    if is_bristled_at_load(p):
        load = at_load(line, load, x, now, p, time_s)
    return Bristles(motor, load)


@inlined
def rubbed(now: Conditions, held: Bristles, p: FloatArray) -> Conditions:
    """Return the conditions with what bristles hold in place of the other laws of dry friction where they are."""
    torque, dry_motor, dry_load, rubbing = now.torque, now.dry_motor, now.dry_load, now.rubbing
    if is_bristled_at_motor(p):
        torque, dry_motor = torque - held.motor, like(0.0, dry_motor)
    if is_bristled_at_load(p):
        rubbing, dry_load = held.load, like(0.0, dry_load)
    return with_friction(now, torque, now.load, dry_motor, dry_load, rubbing)
