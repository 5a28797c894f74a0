"""What changes with time or angle, but not with the state: set once per sub-step."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from estimator.compiled import inlined
from estimator.lanes import broadcast_as, choose, every, some
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.curve import curve, wrapped
from estimator.physics.effects.inertia import frequency_within
from estimator.physics.kernel import slots
from estimator.physics.kernel.laws_at import (
    has_states,
    in_cardan,
    is_shaft_bent,
    load_creep,
    load_damping,
    load_inertia,
    load_over_angle,
    load_presliding,
    load_sliding,
    motor_creep,
    motor_inertia,
    motor_presliding,
    motor_sliding,
    rippled,
    shaft_stiffness,
)
from estimator.physics.kernel.state_vector import Bristles, Conditions, State, Tyre
from estimator.physics.laws import LEAST, fading
from estimator.physics.layout import slot
from estimator.signals.record import FloatArray

STICK_STABILITY = 1.5
"""Runge-Kutta is stable to h * slope / J = 2.78; friction's slope at standstill is held to about half of it."""

EVENTS = np.array(
    [
        [slot(entry.name, name) for name in (entry.parameters[0].name, "from_s", "to_s")]
        for entry in BUILT_IN.values()
        if entry.event
    ]
)
"""Size and both moments of each event."""


class Line(NamedTuple):
    """What a line is made of."""

    masses: int  # 1, 2 or 3
    elastic: bool  # whether the first shaft is a spring and a damper, and no law next to them
    extended: bool  # whether it has states beyond those of its masses
    own: tuple[Any, ...]  # the user's laws: compiled functions and the places of their parameters; () without


@inlined
def is_elastic(p: FloatArray) -> bool:
    """Tell whether the first shaft is a spring and a damper, and no law next to them."""
    return not (is_shaft_bent(p) or p[slots.TABLE_TWIST] > 0.0 or p[slots.TABLE_RATE] > 0.0)


@inlined
def is_bristled(p: FloatArray) -> bool:
    """Tell whether dry friction, at the motor or at the load, deflects before it slides."""
    return is_bristled_at_motor(p) or is_bristled_at_load(p)


@inlined
def is_bristled_at_motor(p: FloatArray) -> bool:
    """Tell whether dry friction at the motor deflects before it slides."""
    return some(motor_presliding(p) > 0.0)


@inlined
def is_bristled_at_load(p: FloatArray) -> bool:
    """Tell whether dry friction at the load deflects before it slides, that of a brake included."""
    return some(load_presliding(p) > 0.0)


@inlined
def is_extended(p: FloatArray) -> bool:
    """Tell whether a line has states beyond those of its masses."""
    return bool(p[slots.BRANCH_INERTIA] > 0.0 or is_within(p) or p[slots.SLIP] > 0.0 or has_states(p))


@inlined
def is_within(p: FloatArray) -> bool:
    """Tell whether the inertia of an extra mode is in the line, before the shaft or behind it, and not next to it."""
    return some(p[slots.BETWEEN] > 0.0) or some(p[slots.BEHIND] > 0.0)


@inlined
def is_changing(begin_s: float, end_s: float, p: FloatArray) -> bool:
    """Tell whether an event begins or ends within a step [s]."""
    for i in range(EVENTS.shape[0]):
        if some(p[EVENTS[i, 0]] != 0.0) and is_edge(begin_s, end_s, p[EVENTS[i, 1]], p[EVENTS[i, 2]]):
            return True
    return False


@inlined
def is_edge(begin_s: float, end_s: float, from_s: float, to_s: float) -> bool:
    """Tell whether one of two moments lies between two times."""
    begins = (begin_s <= from_s) & (from_s <= end_s)
    ends = (begin_s <= to_s) & (to_s <= end_s)
    return some(begins | ends)


@inlined
def line_share(p: FloatArray) -> float:
    """Return by which share of its stiffness the shaft stands for itself and a spring in the line with it."""
    return 1.0 if is_within(p) else float(p[slots.LINE_SHARE])


@inlined
def branch_inertia(p: FloatArray) -> float:
    """Return the inertia of the extra mode [kg m^2], next to the line, before the shaft or behind it."""
    return float(p[slots.BRANCH_INERTIA] + p[slots.BETWEEN] + p[slots.BEHIND])


@inlined
def branch_frequency(p: FloatArray) -> float:
    """Return the frequency of the extra mode on its own spring [rad/s]; within the line that follows."""
    if is_within(p):
        return frequency_within(branch_inertia(p), p[slots.K], p[slots.LINE_SHARE])
    return 2.0 * math.pi * float(p[slots.BRANCH_FREQUENCY])


@inlined
def conditions(
    masses: int, time_s: float, h: float, angle: float, load: float, sign_width: float, p: FloatArray
) -> Conditions:
    """Return what holds during the sub-step of length ``h`` [s] from ``time_s`` on, at a motor angle [rad]."""
    torque, torque_share = rippled(angle, p)
    shaft, shaft_share, joint_angle, joint_rate = in_cardan(angle, p)
    if some(p[slots.TABLE_ANGLE] > 0.0):
        load += curve(wrapped(angle + p[slots.TABLE_PHASE], p, slots.TABLE_ANGLE), p, slots.TABLE_ANGLE, True)[0]
    load += load_over_angle(angle, p)
    inertia_motor = motor_inertia(p[slots.J_M], time_s, h, p)
    inertia_load = load_inertia(p[slots.J_L], time_s, h, p) if masses > 1 else 0.0
    if masses == 1:
        inertia_motor = load_inertia(inertia_motor, time_s, h, p)
    rest = broadcast_as(0.0, p[slots.J_M])  # a speed of 0, of as many lines as there are parameters
    dry_motor, dry_load = motor_sliding(rest, p), load_sliding(time_s, h, p)
    wheel_inertia = choose(p[slots.SLIP] > 0.0, p[slots.SLIP_WHEEL] * inertia_load, inertia_load)
    carried = inertia_motor if masses == 1 else wheel_inertia
    fastest = STICK_STABILITY / h
    lightest = min(inertia_motor, p[slots.J_2] if masses == 3 else carried)
    if is_within(p):
        lightest = min(lightest, branch_inertia(p))
    return Conditions(
        torque,
        load,
        broadcast_as(0.0, load),
        1.0 + torque_share,
        shaft,
        1.0 + shaft_share,
        joint_angle,
        joint_rate,
        1.0 / inertia_motor,
        inertia_load,
        1.0 / inertia_load if masses > 1 else 0.0,
        shaft_stiffness(p[slots.K] * line_share(p), time_s, h, p),
        load_damping(p[slots.B_L], time_s, h, p),
        dry_motor,
        dry_load,
        max(changing_sign(sign_width, motor_creep(p)), dry_motor / (fastest * inertia_motor)),
        max(changing_sign(sign_width, load_creep(p)), dry_load / (fastest * carried)),
        branch_inertia(p),
        branch_frequency(p),
        fastest,
        fastest * fastest * lightest,
        tyre(inertia_load, fastest, p),
    )


@inlined
def changing_sign(width: float, creep: float) -> float:
    """Return the speed within which dry friction changes sign [rad/s]: the usual one where no law creeps."""
    return choose(creep > 0.0, creep, width)


@inlined
def tyre(inertia: float, fastest: float, p: FloatArray) -> Tyre:
    """Return what a tyre's law takes from its parameters, the load's inertia and the fastest decay; 0 without slip."""
    if every(p[slots.SLIP] <= 0.0):
        none = broadcast_as(0.0, inertia)
        return Tyre(none, none, none, none, none, none, none)
    wheel, vehicle = p[slots.SLIP_WHEEL] * inertia, (1.0 - p[slots.SLIP_WHEEL]) * inertia
    tread = 1.0 / p[slots.SLIP]
    winding = 0.0
    if some(p[slots.RELAXATION] > 0.0):
        winding = min(p[slots.CARCASS] * tread / p[slots.RELAXATION], wheel * fastest)
    return Tyre(
        tread,
        tread / (wheel * fastest * fastest),
        winding,
        1.0 / p[slots.SLIP_SPEED],
        1.0 / p[slots.GRIP],
        1.0 / wheel,
        1.0 / vehicle,
    )


@inlined
def with_friction(
    now: Conditions, torque: float, load: float, dry_motor: float, dry_load: float, rubbing: float
) -> Conditions:
    """Return the conditions with other torques and other friction [Nm] at the motor and the load."""
    return Conditions(
        torque,
        load,
        rubbing,
        now.torque_factor,
        now.shaft_extra,
        now.shaft_factor,
        now.joint_angle,
        now.joint_rate,
        now.inverse_motor,
        now.inertia_load,
        now.inverse_load,
        now.stiffness,
        now.viscous_load,
        dry_motor,
        dry_load,
        now.width_motor,
        now.width_load,
        now.branch_inertia,
        now.branch_frequency,
        now.fastest,
        now.stiffest,
        now.tyre,
    )


@inlined
def with_torques(now: Conditions, torque: float, load: float) -> Conditions:
    """Return the conditions with other torques [Nm] at the motor and the load."""
    return with_friction(now, torque, load, now.dry_motor, now.dry_load, now.rubbing)


@inlined
def with_torque(now: Conditions, torque: float) -> Conditions:
    """Return the conditions with a torque [Nm] next to the ripple."""
    return with_torques(now, now.torque + torque * now.torque_factor, now.load)


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
    """Return the torque of the motor's bristles after a time at the speed of a state [Nm]."""
    stiff = now.dry_motor / motor_presliding(p)
    stiff = min(stiff, now.fastest * now.fastest / now.inverse_motor)
    return followed(torque, x.speed, motor_sliding(x.speed, p), stiff, time_s)


@inlined
def at_load(line: Line, torque: float, x: State, now: Conditions, p: FloatArray, time_s: float) -> float:
    """Return the torque of the bristles at the load behind a sub-step [Nm]."""
    speed, inverse_inertia = x.load_speed, now.inverse_load
    if line.masses == 1:
        speed, inverse_inertia = x.speed, now.inverse_motor
    elif line.extended and some(p[slots.SLIP] > 0.0):
        inverse_inertia = now.tyre.inverse_wheel
    limit = now.dry_load
    stiff = limit / load_presliding(p)
    stiff = min(stiff, now.fastest * now.fastest / inverse_inertia)
    return followed(min(max(torque, -limit), limit), speed, limit, stiff, time_s)


@inlined
def bent(line: Line, held: Bristles, x: State, now: Conditions, p: FloatArray, time_s: float) -> Bristles:
    """Return the bristles' torques behind a sub-step."""
    motor, load = held.motor, held.load
    if is_bristled_at_motor(p):
        motor = at_motor(motor, x, now, p, time_s)
    if is_bristled_at_load(p):
        load = at_load(line, load, x, now, p, time_s)
    return Bristles(motor, load)


@inlined
def rubbed(now: Conditions, held: Bristles, p: FloatArray) -> Conditions:
    """Return the conditions with the bristles' torques in them, in place of dry friction by the sign of the speed."""
    torque, dry_motor, dry_load, rubbing = now.torque, now.dry_motor, now.dry_load, now.rubbing
    if is_bristled_at_motor(p):
        torque, dry_motor = torque - held.motor, broadcast_as(0.0, dry_motor)
    if is_bristled_at_load(p):
        rubbing, dry_load = held.load, broadcast_as(0.0, dry_load)
    return with_friction(now, torque, now.load, dry_motor, dry_load, rubbing)
