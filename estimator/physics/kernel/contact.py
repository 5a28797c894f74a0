"""A sub-step of a line with a gap: where its faces meet or part, in smaller ones.

A Runge-Kutta step takes the torque for smooth. At the edge of a gap the shaft's damping sets in, and the fourth order
is lost: with the steps that every other law does with, the error of a free run over a gap is a fifth of the noise of a
resolver, and the size of the gap found is off by as much as its interval is wide.
"""

from __future__ import annotations

from estimator.compiled import inlined
from estimator.lanes import choose, every, like, some
from estimator.physics.kernel import slots
from estimator.physics.kernel.line import Line
from estimator.physics.kernel.runge_kutta import runge_kutta
from estimator.physics.kernel.state_vector import Conditions, State
from estimator.signals.record import FloatArray

PARTS = 8
"""Steps that are taken in place of one."""

DEPTHS, FAST = 4.0, 0.25
"""Depths of contact, ``e_c``, beyond the edge of a gap in which its damping sets in, where a step covers this share of
one: the damping is smooth, but not over such a step."""


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
    parts, done, length = 1, 0, like(h, x.speed)
    rest, share = length, like(1.0, x.speed)
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
