"""Laws of a user's own in the equations of motion: one function of the motion for all laws of a model.

Most lines have none. ``Line.own`` is then an empty tuple, of another type, and the simulation is compiled without them.
"""

from __future__ import annotations

from typing import Any

from estimator.lanes.tools import overload
from estimator.physics.kernel.conditions import with_torques
from estimator.physics.kernel.line import Line
from estimator.physics.kernel.state_vector import Conditions, State
from estimator.signals.record import FloatArray


def at_moment(line: Line, time_s: float, k: int) -> Line:
    """Return a line whose own laws are given this time [s] and the torque reading of sample k."""
    if len(line.own) == 0:
        return line
    readings, forces = line.own[0], line.own[1]
    return Line(line.masses, line.elastic, line.sliding, line.extended, (readings, forces, time_s, readings[k]))


@overload(at_moment, strict=False)
def _at_moment(line: Any, time_s: Any, k: Any) -> Any:
    if len(line.types[-1]) == 0:
        return lambda line, time_s, k: line
    return at_moment


def under_own(now: Conditions, line: Line, x: State, p: FloatArray) -> Conditions:
    """Return the conditions with the torques of a line's own laws on the motor and against the load."""
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
