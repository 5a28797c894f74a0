"""What happens in the line of a fit: its states, as it is and under further torques."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.line.averages import block_mean
from estimator.diagnosis.line.tangent import LOAD, MOTOR
from estimator.physics.fit import FitResult
from estimator.physics.kernel import state_vector
from estimator.physics.model import Structure
from estimator.physics.motion import motor_angle
from estimator.physics.problem import Problem, local_part, parameters
from estimator.physics.simulate import simulate_each
from estimator.physics.start import Case
from estimator.signals.record import FloatArray, Record


@dataclass(frozen=True, slots=True)
class Motion:
    """What happens in one recording, for laws to be functions of; arrays of shape (B,), one value per block.

    ``angle`` is by the recording's own output; ``inputs`` has shape (B, M).
    """

    time_s: FloatArray
    torque: FloatArray
    inputs: FloatArray
    angle: FloatArray
    speed: FloatArray
    twist: FloatArray
    load_speed: FloatArray


Force = tuple[FloatArray | float, FloatArray | float]
"""Torque on the motor and torque against the load, in addition to the model's, shape (N,) each [Nm]."""

NO_FORCE: Force = (0.0, 0.0)


def simulated(result: FitResult, index: int, force: Force = NO_FORCE, state: int | None = None) -> FloatArray:
    """Simulate a recording at a fit's unknowns under further torques: its output, or a state; shape (N,)."""
    only: FloatArray = simulated_each(result, [result.x], index, force, state)[0]
    return only


def simulated_each(
    result: FitResult, points: Sequence[FloatArray], index: int, force: Force = NO_FORCE, state: int | None = None
) -> FloatArray:
    """Simulate a recording at K vectors of a fit's unknowns under further torques, shape (K, N); see ``simulated``."""
    problem = result.problem
    torque = problem.records[index].torque_nm.copy()
    torque[:, 0] += force[MOTOR]
    record = replace(problem.records[index], torque_nm=torque)
    cases = [_case(problem, x, index, force[LOAD] + np.zeros(torque.shape[0])) for x in points]
    return simulate_each(problem.grid, record, cases, state)


def _case(problem: Problem, x: FloatArray, index: int, load_nm: FloatArray) -> Case:
    basis, local = problem.local[index], local_part(problem, x, index)
    profile = basis.extra_load(local)
    loaded = load_nm if profile is None else load_nm + profile
    return Case(basis.parameters(parameters(problem, x), local), basis.start(local), loaded)


def motion_of(result: FitResult, index: int) -> Motion:
    """Simulate every state of one recording at a fit, at every sample."""
    return motion_in_blocks(result.problem.records[index], states_of(result, index), 1)


def states_of(result: FitResult, index: int, force: Force = NO_FORCE) -> dict[str, FloatArray]:
    """Simulate every state of one recording at a fit; the angle is by the recording's own output."""
    wanted = (state_vector.SPEED, state_vector.TWIST, state_vector.LOAD_SPEED)
    speed, twist, load_speed = (simulated(result, index, force, state) for state in wanted)
    if result.problem.grid.structure is Structure.ONE_MASS:
        load_speed = speed
    angle = motor_angle(result.problem.records[index])
    return {"angle": angle, "speed": speed, "twist": twist, "load_speed": load_speed}


def motion_in_blocks(record: Record, states: dict[str, FloatArray], length: int) -> Motion:
    """Return sampled states of one recording, with its time and torque, averaged over blocks."""
    return Motion(
        block_mean(record.time_s, length),
        block_mean(record.total_torque_nm, length),
        block_mean(record.torque_nm, length),
        **{name: block_mean(values, length) for name, values in states.items()},
    )


def between(values: FloatArray) -> FloatArray:
    """Return a sampled signal half a sample later, where the torque held from a sample on has its middle."""
    later = np.append(values[1:], 2.0 * values[-1] - values[-2])
    middle: FloatArray = 0.5 * (values + later)
    return middle
