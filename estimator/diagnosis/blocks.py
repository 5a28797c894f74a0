"""Recordings of a fit cut into blocks of samples: the rows on which its error is explained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.diagnosis.tangent import LOAD, MOTOR, Tangent, block_length, tangent
from estimator.physics import kernel
from estimator.physics.fit import FitResult, start_of
from estimator.physics.model import Structure
from estimator.physics.simulate import motor_angle, simulate
from estimator.signals.record import BoolArray, FloatArray, Record


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


@dataclass(frozen=True, slots=True)
class Line:
    """One recording of a fit, in blocks.

    Attributes
    ----------
    record : Record
    length : int
        Samples per block.
    tangent : Tangent
    error : ndarray, shape (B,)
        Measured less simulated output, averaged over the block's good samples; 0 where there are none.
    weight : ndarray, shape (B,)
        How many samples of the block count.
    motion : Motion
        As the fit has it, in the middle of each block.
    reading : Motion
        The same at the moments at which the output was read.
    stretches : ndarray of bool, shape (B,)
        Where laws are fitted: everywhere, or in stretches spread over a long recording.
    """

    record: Record
    length: int
    tangent: Tangent
    error: FloatArray
    weight: FloatArray
    motion: Motion
    reading: Motion
    stretches: BoolArray

    @property
    def okay(self) -> BoolArray:
        """Blocks with at least half their samples, shape (B,)."""
        return np.asarray(2 * self.weight >= self.length)

    @property
    def rows(self) -> BoolArray:
        """Blocks that laws are fitted to, shape (B,)."""
        return self.okay & self.stretches

    @property
    def period_s(self) -> float:
        """Length of a block [s]."""
        return self.length * self.record.sample_time_s

    def samples(self, values: FloatArray) -> FloatArray:
        """Hold a signal of shape (B,) over the samples of each block, the last to the end; shape (N,)."""
        held = np.repeat(values, self.length)
        return np.concatenate([held, np.full(self.record.time_s.size - held.size, held[-1])])

    @property
    def size(self) -> int:
        """Number of blocks."""
        return int(self.error.size)


Force = tuple[FloatArray | float, FloatArray | float]
"""Torque on the motor and torque against the load beside the model's, shape (N,) each [Nm]."""

NO_FORCE: Force = (0.0, 0.0)


MOST_ROWS = 30_000
"""Blocks that laws are fitted to, all recordings together: five minutes at 10 ms. They bound memory."""

STRETCH = 3000
"""Blocks of a stretch of a long recording."""


def spread_stretches(blocks: int, most: int) -> BoolArray:
    """Return which blocks of a recording are used: all, or evenly spread stretches of at most so many; (blocks,)."""
    used = np.ones(blocks, dtype=np.bool_)
    if blocks <= most:
        return used
    length = min(STRETCH, most)
    starts = np.linspace(0, blocks - length, max(most // length, 1)).astype(int)
    used[:] = False
    for start in starts:
        used[start : start + length] = True
    return used


def lines(result: FitResult, forces: Sequence[Force] | None = None) -> tuple[Line, ...]:
    """Return the recordings of a fit in blocks, under further torques where there are any."""
    length = block_length(result)
    count = len(result.problem.records)
    every = [NO_FORCE] * count if forces is None else forces
    return tuple(_line(result, i, length, force) for i, force in enumerate(every))


def simulated(result: FitResult, index: int, force: Force = NO_FORCE, state: int | None = None) -> FloatArray:
    """Simulate a recording at a fit's unknowns under further torques: its output, or a state; shape (N,)."""
    problem = result.problem
    record, basis = problem.records[index], problem.local[index]
    torque = record.torque_nm.copy()
    torque[:, 0] += force[MOTOR]
    load = basis.extra_load(result.local_of(index))
    return simulate(
        problem.grid,
        replace(record, torque_nm=torque),
        result.p_of(index),
        start_of(problem, result.x, index),
        force[LOAD] + (np.zeros(torque.shape[0]) if load is None else load),
        state,
    )


def block_mean(values: FloatArray, length: int) -> FloatArray:
    """Average a signal of shape (N, ...) over blocks, shape (N // length, ...)."""
    count = values.shape[0] // length
    if length == 1:
        return values[:count]
    mean: FloatArray = values[: count * length].reshape(count, length, *values.shape[1:]).mean(axis=1)
    return mean


def block_mean_of(values: FloatArray, use: BoolArray, length: int) -> tuple[FloatArray, FloatArray]:
    """Average the samples in use over blocks: the means, 0 where there are none, and how many there are; (B,)."""
    weight = block_mean(use.astype(float), length) * length
    total = block_mean(np.where(use, values, 0.0), length) * length
    return total / np.maximum(weight, 1.0), weight


def _line(result: FitResult, index: int, length: int, force: Force) -> Line:
    record = result.problem.records[index]
    use = result.problem.use[index]
    error, weight = block_mean_of(record.output - result.outputs[index], use, length)
    states = _states(result, index, force)
    return Line(
        record,
        length,
        tangent(result, index, length),
        error,
        weight,
        _motion(record, {name: _between(values) for name, values in states.items()}, length),
        _motion(record, states, length),
        spread_stretches(error.size, MOST_ROWS // len(result.problem.records)),
    )


def motion_of(result: FitResult, index: int) -> Motion:
    """Simulate every state of one recording at a fit, at every sample."""
    return _motion(result.problem.records[index], _states(result, index), 1)


def _between(values: FloatArray) -> FloatArray:
    """Return a sampled signal half a sample later, where the torque held from a sample on has its middle."""
    later = np.append(values[1:], 2.0 * values[-1] - values[-2])
    middle: FloatArray = 0.5 * (values + later)
    return middle


def _motion(record: Record, states: dict[str, FloatArray], length: int) -> Motion:
    return Motion(
        block_mean(record.time_s, length),
        block_mean(record.total_torque_nm, length),
        block_mean(record.torque_nm, length),
        **{name: block_mean(values, length) for name, values in states.items()},
    )


def _states(result: FitResult, index: int, force: Force = NO_FORCE) -> dict[str, FloatArray]:
    """Simulate every state of one recording at a fit; the angle is by the recording's own output."""
    wanted = (kernel.SPEED, kernel.TWIST, kernel.LOAD_SPEED)
    speed, twist, load_speed = (simulated(result, index, force, state) for state in wanted)
    if result.problem.grid.structure is Structure.ONE_MASS:
        load_speed = speed
    angle = motor_angle(result.problem.records[index])
    return {"angle": angle, "speed": speed, "twist": twist, "load_speed": load_speed}
