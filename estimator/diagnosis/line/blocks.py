"""Recordings of a fit cut into blocks of samples: the rows on which its error is explained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from estimator.diagnosis.line.motion import NO_FORCE, Force, Motion, between, block_mean_of, motion_in_blocks, states_of
from estimator.diagnosis.line.tangent import Tangent, block_length, tangent
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.physics.motion import speed_scale, torque_scale
from estimator.physics.parallel import concurrently
from estimator.signals.record import BoolArray, FloatArray, Record


class Place(Enum):
    """Where an unknown input may act: on the motor, in the shaft, against the load, on the reading."""

    MOTOR = "motor"
    SHAFT = "shaft"
    LOAD = "load"
    SENSOR = "sensor"


FORCES = {Place.MOTOR: (1.0, 0.0), Place.SHAFT: (-1.0, -1.0), Place.LOAD: (0.0, 1.0), Place.SENSOR: (0.0, 0.0)}
"""Torque on the motor and torque against the load per unit of the input."""

PLACES = {
    Element.TORQUE_PATH: Place.MOTOR,
    Element.MOTOR: Place.MOTOR,
    Element.SHAFT: Place.SHAFT,
    Element.LOAD: Place.LOAD,
    Element.SPEED_SENSOR: Place.SENSOR,
    Element.ACQUISITION: Place.SENSOR,
}
"""Where a law of an element acts."""

DRIVES = {Element.TORQUE_PATH: 1.0, Element.MOTOR: -1.0, Element.SHAFT: 1.0, Element.LOAD: 1.0}
"""Sign of a law at its place: the torque path drives the motor, friction at the motor brakes it."""


def places(result: FitResult) -> tuple[Place, ...]:
    if result.problem.grid.structure is Structure.JOINT:
        return (Place.SHAFT,)
    if result.problem.grid.structure is Structure.ONE_MASS:
        return (Place.MOTOR, Place.SENSOR)
    return tuple(Place)


def size_at(result: FitResult, place: Place) -> float:
    records = result.problem.records
    return speed_scale(records) if place is Place.SENSOR else torque_scale(records)


MOST_ROWS = 20_000
"""Blocks that laws are fitted to, all recordings together: over three minutes at 10 ms. They bound memory."""

STRETCH = 3000
"""Blocks of a stretch of a long recording."""


@dataclass(frozen=True, slots=True)
class Line:
    """One recording of a fit, in blocks."""

    record: Record
    length: int  # samples per block
    tangent: Tangent
    error: FloatArray  # (B,): measured less simulated output, averaged over the block's good samples
    weight: FloatArray  # (B,): how many samples of the block count
    motion: Motion  # as the fit has it, in the middle of each block
    reading: Motion  # the same at the moments at which the output was read
    stretches: BoolArray  # (B,): where laws are fitted

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


def lines(result: FitResult, forces: Sequence[Force] | None = None, length: int | None = None) -> tuple[Line, ...]:
    """Return the recordings of a fit in blocks, under further torques where there are any.

    ``length`` is the samples per block, by default as few as the fit's own line needs.
    """
    length = length or block_length(result)
    count = len(result.problem.records)
    every = [NO_FORCE] * count if forces is None else forces
    return tuple(concurrently(lambda i: _line(result, i, length, every[i]), range(count)))


def _line(result: FitResult, index: int, length: int, force: Force) -> Line:
    record = result.problem.records[index]
    use = result.problem.use[index]
    error, weight = block_mean_of(record.output - result.outputs[index], use, length)
    states = states_of(result, index, force)
    return Line(
        record,
        length,
        tangent(result, index, length),
        error,
        weight,
        motion_in_blocks(record, {name: between(values) for name, values in states.items()}, length),
        motion_in_blocks(record, states, length),
        spread_stretches(error.size, MOST_ROWS // len(result.problem.records)),
    )


def spread_stretches(blocks: int, most: int) -> BoolArray:
    used = np.ones(blocks, dtype=np.bool_)
    if blocks <= most:
        return used
    length = min(STRETCH, most)
    starts = np.linspace(0, blocks - length, max(most // length, 1)).astype(int)
    used[:] = False
    for start in starts:
        used[start : start + length] = True
    return used
