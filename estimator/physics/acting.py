"""Where a law acts that needs no place of its own in the equations: the simulation takes it from its entry.

A law that changes the line itself (a gap, a tyre, an inertia more) stands in ``estimator.physics.kernel``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any


class Place(Enum):
    """Where a law acts, and so what it is given before its parameters, and what it returns.

    Those of a speed or an angle are compiled: for one simulation and for several side by side (``estimator.lanes``).

    Attributes
    ----------
    TORQUE
        ``law(torque, since_start_s, ...)``, arrays of shape (N,): reading of all inputs together [Nm] to the torque
        that acts.
    MOTOR, LOAD
        ``law(speed, ...)``: speed [rad/s] to the torque against a motion forward [Nm].
    LOAD_ANGLE
        ``law(angle, ...)``: simulated angle of the load [rad] to the torque against it [Nm].
    RECORDED_ANGLE
        The same of the motor's angle as recorded, from 0 at the start: where a simulated one would drift away.
    SHAFT_LOSS
        ``law(torque, sign, ...)``: torque of the shaft [Nm] and the sign of the load's speed, rounded at standstill, to
        what of it does not reach the load [Nm].
    """

    TORQUE = "torque"
    MOTOR = "motor"
    LOAD = "load"
    LOAD_ANGLE = "load_angle"
    RECORDED_ANGLE = "recorded_angle"
    SHAFT_LOSS = "shaft_loss"


@dataclass(frozen=True, slots=True)
class Acting:
    """A law at a place: it takes all parameters of its entry, in their order, behind what the place gives."""

    place: Place
    law: Callable[..., Any]
