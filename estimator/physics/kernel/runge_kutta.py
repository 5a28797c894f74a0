"""One sub-step of a line: the classical Runge-Kutta method of fourth order."""

from __future__ import annotations

from estimator.compiled import inlined
from estimator.physics.kernel.conditions import with_torque
from estimator.physics.kernel.line import Line
from estimator.physics.kernel.rates import rates
from estimator.physics.kernel.state_vector import Conditions, State
from estimator.signals.record import FloatArray


@inlined
def moved(line: Line, x: State, dx: State, h: float) -> State:
    """Return a state moved along its derivative for a time [s]; what a line lacks stays where it is, at no cost."""
    twist, load_speed, middle_twist, middle_speed = x.twist, x.load_speed, x.middle_twist, x.middle_speed
    if line.masses > 1:
        twist, load_speed = twist + h * dx.twist, load_speed + h * dx.load_speed
    if line.masses == 3:
        middle_twist, middle_speed = middle_twist + h * dx.middle_twist, middle_speed + h * dx.middle_speed
    loading, vehicle_speed, traction = x.loading, x.vehicle_speed, x.traction
    branch_twist, branch_speed, relaxing = x.branch_twist, x.branch_speed, x.relaxing
    if line.sliding:
        loading += h * dx.loading
    if line.extended:
        vehicle_speed, traction = vehicle_speed + h * dx.vehicle_speed, traction + h * dx.traction
        branch_twist, branch_speed = branch_twist + h * dx.branch_twist, branch_speed + h * dx.branch_speed
        relaxing += h * dx.relaxing
    return State(
        x.angle + h * dx.angle,
        x.speed + h * dx.speed,
        twist,
        load_speed,
        loading,
        vehicle_speed,
        branch_twist,
        branch_speed,
        middle_twist,
        middle_speed,
        traction,
        relaxing,
    )


@inlined
def runge_kutta(line: Line, now: Conditions, torque: float, rise: float, x: State, p: FloatArray, h: float) -> State:
    """Return the state after one sub-step under constant conditions and a torque of this mean and rise [Nm]."""
    begin = with_torque(now, torque - 0.5 * rise)
    middle = with_torque(now, torque)
    end = with_torque(now, torque + 0.5 * rise)
    first = rates(line, begin, x, p)
    second = rates(line, middle, moved(line, x, first, 0.5 * h), p)
    third = rates(line, middle, moved(line, x, second, 0.5 * h), p)
    fourth = rates(line, end, moved(line, x, third, h), p)
    x = moved(line, x, first, h / 6.0)
    x = moved(line, x, second, h / 3.0)
    x = moved(line, x, third, h / 3.0)
    return moved(line, x, fourth, h / 6.0)
