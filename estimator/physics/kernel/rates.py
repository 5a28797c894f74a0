"""The equations of motion, with the law of every effect at its place."""

from __future__ import annotations

from typing import Any

from estimator.compiled import inlined
from estimator.lanes import broadcast_as, choose, every, some
from estimator.lanes.types import overload
from estimator.physics.curve import curve
from estimator.physics.effect import Around
from estimator.physics.effects.load import build_up, carcass, coupling, gripped
from estimator.physics.effects.shaft import damping_share, pressed
from estimator.physics.kernel import slots
from estimator.physics.kernel.conditions import (
    Line,
    is_within,
    line_share,
    with_torque,
    with_torques,
)
from estimator.physics.kernel.laws_at import (
    held_by_angle,
    load_drag,
    load_memory,
    motor_drag,
    motor_memory,
    motor_sliding,
    moved_states,
    no_states,
    shaft_loss,
    shaft_memory,
    spring_twist,
    state_rates,
)
from estimator.physics.kernel.sensing import entry
from estimator.physics.kernel.state_vector import SHAFT_TORQUE, Conditions, State
from estimator.physics.laws import beyond_gap, dry_friction, smooth_sign
from estimator.signals.record import FloatArray

PARTS = 8  # steps that are taken in place of one

STAGES = 4
"""Of the classical Runge-Kutta method. Each begins with the slope of the one before it; that of the first counts for
nothing."""

DEPTHS, FAST = 4.0, 0.25
"""Depths of contact, ``e_c``, beyond the edge of a gap in which its damping sets in, where a step covers this share of
one: the damping is smooth, but not over such a step."""


def at_moment(line: Line, time_s: float, k: int) -> Line:
    """Return a line whose own laws are given this time [s] and the torque reading of sample k."""
    if len(line.own) == 0:
        return line
    readings, forces = line.own[0], line.own[1]
    return Line(line.masses, line.elastic, line.extended, (readings, forces, time_s, readings[k]))


@overload(at_moment, strict=False)
def _at_moment(line: Any, time_s: Any, k: Any) -> Any:
    if len(line.types[-1]) == 0:
        return lambda line, time_s, k: line
    return at_moment


def under_own(now: Conditions, line: Line, x: State, p: FloatArray) -> Conditions:
    """Return the conditions with the torques of the user's own laws added."""
    if len(line.own) == 0:
        return now
    if line.masses == 1:
        motor, load = line.own[1](line.own[2], x.speed, x.speed, 0.0, line.own[3], p)
    else:
        motor, load = line.own[1](line.own[2], x.speed, x.load_speed, x.twist, line.own[3], p)
    return with_torques(now, now.torque + motor, now.load + load)


@overload(under_own, strict=False)
def _under_own(now: Any, line: Any, x: Any, p: Any) -> Any:
    if len(line.types[-1]) == 0:
        return lambda now, line, x, p: now
    return under_own


@inlined
def motor_friction(speed: float, p: FloatArray, width: float, dry: float) -> float:
    """Return the torque of every friction law at the motor [Nm], viscous included; the dry ones where there are any."""
    friction = float(p[slots.B_M]) * speed
    friction += motor_drag(speed, p)
    if some(p[slots.TABLE_MOTOR_SPEED] > 0.0):
        friction += curve(speed, p, slots.TABLE_MOTOR_SPEED, False)[0]
    if every(dry == 0.0):
        return friction
    return friction + motor_sliding(speed, p) * smooth_sign(speed, width)


@inlined
def around(now: Conditions) -> Around:
    """Return what a law with a state is given of the line."""
    return Around(now.stiffness, now.fastest, now.stiffest)


@inlined
def damping_torque(rate: float, p: FloatArray) -> float:
    """Return the torque of the shaft's damper [Nm] at the rate of its twist [rad/s]."""
    share = line_share(p)
    return float(p[slots.C]) * share * share * rate


@inlined
def shaft_torque(line: Line, twist: float, rate: float, now: Conditions, x: State, p: FloatArray) -> float:
    """Return the torque the shaft carries [Nm] at a twist [rad] and its rate [rad/s]."""
    damping = damping_torque(rate, p)
    across = broadcast_as(0.0, damping)
    held = broadcast_as(0.0, damping)
    if some(p[slots.TABLE_TWIST] > 0.0):
        held, slope = curve(twist, p, slots.TABLE_TWIST, False)
        damping = damping * max(1.0 + slope / p[slots.K], 0.0) + p[slots.TABLE_DAMPING] * rate
    if some(p[slots.TABLE_RATE] > 0.0):
        held += curve(rate, p, slots.TABLE_RATE, False)[0]
    loaded, closed = twist, every(p[slots.GAP] <= 0.0)
    if not closed:
        loaded = beyond_gap(twist, p[slots.GAP])
        across = damping * p[slots.ACROSS]
        damping = (damping - across) * damping_share(loaded, p[slots.CONTACT])
    torque = float(now.stiffness * spring_twist(loaded, p)) + damping
    if line.extended:
        torque += shaft_memory(loaded, rate, x.law_states, around(now), p)
    return held + (torque if closed else pressed(torque, loaded, p[slots.PULL]) + across)


@inlined
def shaft_torques(line: Line, rate: float, now: Conditions, x: State, p: FloatArray) -> tuple[float, float]:
    """Return the torque the first shaft passes on to the load, and the one it takes from the motor [Nm]."""
    if line.elastic:
        shaft = now.stiffness * x.twist + damping_torque(rate, p)
        if line.extended:
            shaft += shaft_memory(x.twist, rate, x.law_states, around(now), p)
        return shaft, shaft
    joint_rate = now.joint_rate * x.speed
    shaft = shaft_torque(line, x.twist + now.joint_angle, rate + joint_rate, now, x, p)
    shaft = shaft * now.shaft_factor + now.shaft_extra
    return shaft, shaft * (1.0 + now.joint_rate)  # a joint that turns unevenly passes on power, not torque


@inlined
def within(line: Line, p: FloatArray) -> tuple[bool, bool]:
    """Tell whether an extra inertia is in the line before the shaft, and behind it."""
    return line.extended and every(p[slots.BETWEEN] > 0.0), line.extended and every(p[slots.BEHIND] > 0.0)


@inlined
def driven(line: Line, x: State) -> float:
    """Return the speed of what the first shaft drives [rad/s]."""
    return x.middle_speed if line.masses == 3 else x.load_speed


@inlined
def twist_rate(line: Line, x: State, p: FloatArray) -> float:
    """Return the rate of the first shaft's twist [rad/s]."""
    between, behind = within(line, p)
    return (x.branch_speed if between else x.speed) - (x.branch_speed if behind else driven(line, x))


@inlined
def read_out(line: Line, now: Conditions, x: State, output: int, p: FloatArray) -> float:
    """Return an output: of the state, or the torque that the shaft passes on [Nm]."""
    if line.masses > 1 and output == SHAFT_TORQUE:
        return shaft_torques(line, twist_rate(line, x, p), now, x, p)[0]
    return entry(x, output, p)


@inlined
def rates(line: Line, now: Conditions, x: State, p: FloatArray) -> State:
    """Return the time derivative of the mechanical state under the conditions ``now``."""
    now = under_own(now, line, x, p)
    drive = now.torque - motor_friction(x.speed, p, now.width_motor, now.dry_motor)
    states = no_states(x.speed)
    if line.extended:
        drive -= motor_memory(x.speed, x.law_states, around(now), p)
    if line.masses == 1:
        drag = load_friction(x.speed, x.speed, now, p) + now.load + held_by_angle(x.angle, p)
        if line.extended:
            drag += load_memory(x.speed, x.law_states, around(now), p)
            states = state_rates(x.speed, x.speed, x.twist, broadcast_as(0.0, x.speed), x.law_states, around(now), p)
        branch = branch_rate(x.branch_twist, x.speed - x.branch_speed, now, p) if line.extended else 0.0
        acceleration = (drive - now.branch_inertia * branch - drag) * now.inverse_motor
        still = broadcast_as(0.0, x.speed)
        own_rate = x.speed - x.branch_speed
        return State(
            x.speed,
            acceleration,
            still,
            still,
            still,
            own_rate,
            broadcast_as(branch, x.speed),
            still,
            still,
            still,
            states,
        )
    between, behind = within(line, p)
    own_rate = x.branch_speed - driven(line, x) if behind else x.speed - x.branch_speed
    rate = twist_rate(line, x, p)
    shaft, reaction = shaft_torques(line, rate, now, x, p)
    branch = broadcast_as(0.0, x.speed)
    pull = shaft
    if line.extended:
        states = state_rates(x.speed, x.load_speed, x.twist, rate, x.law_states, around(now), p)
        branch = branch_rate(x.branch_twist, own_rate, now, p)
        own = now.branch_inertia * branch
        if behind:
            branch, pull = (shaft - own) / now.branch_inertia, own
        else:
            drive -= own
        if between:
            branch, reaction = branch - reaction / now.branch_inertia, broadcast_as(0.0, x.speed)
    middle_twist, middle_speed = broadcast_as(0.0, x.speed), broadcast_as(0.0, x.speed)
    if line.masses == 3:
        carried = pull
        middle_twist = x.middle_speed - x.load_speed
        pull = float(p[slots.K_2]) * x.middle_twist + float(p[slots.C_2]) * middle_twist
        middle_speed = (carried - pull) / p[slots.J_2]
    load, vehicle, traction = load_rates(line, pull, now, x, p)
    return State(
        x.speed,
        (drive - reaction) * now.inverse_motor,
        rate,
        load,
        vehicle,
        own_rate,
        branch,
        middle_twist,
        middle_speed,
        traction,
        states,
    )


@inlined
def branch_rate(twist: float, rate: float, now: Conditions, p: FloatArray) -> float:
    """Return the acceleration that its spring gives the extra mode's inertia [rad/s^2]; 0 where there is none."""
    if every(now.branch_inertia <= 0.0):
        return 0.0
    frequency = now.branch_frequency
    return frequency * (frequency * twist + 2.0 * float(p[slots.BRANCH_DAMPING]) * rate)


@inlined
def dry_at_load(wheel: float, now: Conditions) -> float:
    """Return the dry friction at the load, or at its wheels [Nm], at their speed; that of bristles included."""
    return dry_friction(wheel, now.dry_load, now.width_load) + now.rubbing


@inlined
def load_friction(wheel: float, vehicle: float, now: Conditions, p: FloatArray) -> float:
    """Return what slows the load down [Nm]: dry friction at the wheel, viscous and other drag at the vehicle."""
    drag = dry_at_load(wheel, now) + now.viscous_load * vehicle + load_drag(vehicle, p)
    if some(p[slots.TABLE_LOAD_SPEED] > 0.0):
        drag += curve(vehicle, p, slots.TABLE_LOAD_SPEED, False)[0]
    return drag


@inlined
def load_angle(line: Line, x: State, p: FloatArray) -> float:
    """Return the angle of the load [rad]."""
    angle = x.angle - x.twist
    if line.masses == 3:
        angle -= x.middle_twist
    return angle - x.branch_twist if line.extended and is_within(p) else angle


@inlined
def load_rates(line: Line, pull: float, now: Conditions, x: State, p: FloatArray) -> tuple[float, float, float]:
    """Return the accelerations of the load and, where the tyre slips, of the vehicle [rad/s^2]; the traction's rate."""
    wheel = x.load_speed
    still = broadcast_as(0.0, wheel)
    pull -= shaft_loss(pull, smooth_sign(wheel, now.width_load), p)
    load = now.load + held_by_angle(load_angle(line, x, p), p)
    if line.extended:
        load += load_memory(x.load_speed, x.law_states, around(now), p)
    if not line.extended or every(p[slots.SLIP] <= 0.0):
        return (pull - load_friction(wheel, wheel, now, p) - load) * now.inverse_load, still, still
    vehicle = x.vehicle_speed
    tyre, slide, rate = now.tyre, wheel - vehicle, still
    inverse_wheel, inverse_vehicle = tyre.inverse_wheel, tyre.inverse_vehicle
    if every(p[slots.RELAXATION] > 0.0):
        traction, roll = x.traction, abs(vehicle)
        relaxation = max(p[slots.RELAXATION], max(roll / now.fastest, tyre.least_relaxation))
        rate = build_up(slide, roll, traction, tyre.tread, relaxation)
        traction += carcass(slide, vehicle, tyre.winding, tyre.inverse_creep)
    else:
        steepest = now.fastest * now.inertia_load
        slope, share = coupling(vehicle, p[slots.SLIP], p[slots.SLIP_SPEED], p[slots.SLIP_WHEEL], steepest)
        inverse_wheel, inverse_vehicle = now.inverse_load / share, now.inverse_load / (1.0 - share)
        traction = slope * slide
    traction = gripped(traction, p[slots.GRIP], tyre.inverse_grip)
    dry = dry_at_load(wheel, now)
    drag = load_friction(wheel, vehicle, now, p) - dry
    return (pull - dry - traction) * inverse_wheel, (traction - drag - load) * inverse_vehicle, rate


@inlined
def advanced(line: Line, x: State, dx: State, h: float) -> State:
    """Return a state moved along its derivative for a time [s]; what a line lacks stays where it is, at no cost."""
    twist, load_speed, middle_twist, middle_speed = x.twist, x.load_speed, x.middle_twist, x.middle_speed
    if line.masses > 1:
        twist, load_speed = twist + h * dx.twist, load_speed + h * dx.load_speed
    if line.masses == 3:
        middle_twist, middle_speed = middle_twist + h * dx.middle_twist, middle_speed + h * dx.middle_speed
    vehicle_speed, traction = x.vehicle_speed, x.traction
    branch_twist, branch_speed, law_states = x.branch_twist, x.branch_speed, x.law_states
    if line.extended:
        vehicle_speed, traction = vehicle_speed + h * dx.vehicle_speed, traction + h * dx.traction
        branch_twist, branch_speed = branch_twist + h * dx.branch_twist, branch_speed + h * dx.branch_speed
        law_states = moved_states(law_states, dx.law_states, h)
    return State(
        x.angle + h * dx.angle,
        x.speed + h * dx.speed,
        twist,
        load_speed,
        vehicle_speed,
        branch_twist,
        branch_speed,
        middle_twist,
        middle_speed,
        traction,
        law_states,
    )


@inlined
def runge_kutta(line: Line, now: Conditions, torque: float, rise: float, x: State, p: FloatArray, h: float) -> State:
    """Return the state after one sub-step under constant conditions and a torque of this mean and rise [Nm].

    The stages are a loop, so that the laws are compiled once and not four times.
    """
    after, dx, sixth, third = x, x, h / 6.0, h / 3.0
    for stage in range(STAGES):
        within = 0 < stage < STAGES - 1
        node = 0.5 if within else 1.0 if stage > 0 else 0.0
        dx = rates(line, with_torque(now, torque + (node - 0.5) * rise), advanced(line, x, dx, node * h), p)
        after = advanced(line, after, dx, third if within else sixth)
    return after


@inlined
def met(begun: float, ended: float, gap: float, contact: float) -> bool:
    """Tell whether the faces of a gap met or parted between two twists, or squeezed out their play."""
    half = 0.5 * gap
    first, last = abs(begun) - half, abs(ended) - half
    least = choose(begun * ended < 0.0, -half, min(first, last))
    edge = choose(abs(ended - begun) > FAST * contact, DEPTHS * contact, 0.0)
    return min(max(first, last), edge - least) > 0.0


@inlined
def stepped(line: Line, now: Conditions, torque: float, rise: float, x: State, p: FloatArray, h: float) -> State:
    """Do what ``runge_kutta`` does, in smaller steps where the faces of a gap meet or part.

    Each lane takes those it needs by itself: the others stand still when they are there.
    """
    if line.elastic:
        return runge_kutta(line, now, torque, rise, x, p, h)
    closed = every(p[slots.GAP] <= 0.0)
    parts, done, length = 1, 0, broadcast_as(h, x.speed)
    rest, share = length, broadcast_as(1.0, x.speed)
    while done < parts:
        along = rise * ((done + 0.5) * share - 0.5)
        ahead = runge_kutta(line, now, torque + along, rise * share, x, p, length)
        if parts == 1 and not closed:
            begun, ended = x.twist + now.joint_angle, ahead.twist + now.joint_angle
            meeting = met(begun, ended, p[slots.GAP], p[slots.CONTACT])
            if some(meeting):
                parts = PARTS
                length, rest = choose(meeting, h / PARTS, h), choose(meeting, h / PARTS, 0.0)
                share = choose(meeting, 1.0 / PARTS, 1.0)
                continue
        x, done, length = ahead, done + 1, rest
    return x
