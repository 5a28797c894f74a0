"""A fit cut into blocks of samples: the motion of its line, and the error in each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum

import numpy as np

from estimator.diagnosis.line.tangent import Tangent, block_length, tangent
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.kernel import slots, state_vector
from estimator.physics.model import Structure
from estimator.physics.motion import motor_angle, speed_scale, torque_scale
from estimator.physics.parallel import concurrently
from estimator.physics.problem import case_of
from estimator.physics.simulate import simulate_each
from estimator.signals.record import BoolArray, FloatArray, Record

AROUND = 2  # samples before and behind a moment between which a law's change counts
LASTS = 3.0  # samples over which such an error is correlated: about as long as a change counts

_MOTOR = (slots.COULOMB, slots.STRIBECK, slots.STRIBECK_COULOMB)
_LOAD = (slots.COULOMB_LOAD, slots.BRAKE)
_SHAFT = (slots.GAP, slots.STAGE)

DRIVES = {Element.TORQUE_PATH: 1.0, Element.MOTOR: -1.0, Element.SHAFT: 1.0, Element.LOAD: 1.0}
"""Sign of a law at its place: the torque path drives the motor, friction at the motor brakes it."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What happens in one recording, for laws to be functions of; arrays of shape (B,), one value per block.

    ``angle`` is by the recording's own output.
    """

    time_s: FloatArray  # from the recording's beginning
    torque: FloatArray  # sum of the inputs [Nm]
    angle: FloatArray
    speed: FloatArray  # of the motor
    twist: FloatArray  # of the shaft
    load_speed: FloatArray  # behind the shaft; of one mass the motor's


def simulated(result: FitResult, index: int, state: int | None = None) -> FloatArray:
    """Simulate a recording at a fit's unknowns: its output, or a state; shape (N,)."""
    problem = result.problem
    case = case_of(problem.local[index], result.p, result.local_of(index))
    return simulate_each(problem.grid, problem.records[index], [case], state)[0]


def motion_of(result: FitResult, index: int) -> Motion:
    """Return what happens in a recording as a fit simulates it, sample by sample."""
    return motion_in_blocks(result.problem.records[index], states_of(result, index), 1)


def states_of(result: FitResult, index: int) -> dict[str, FloatArray]:
    """Return angle [rad], speeds [rad/s] and twist [rad] of a recording as a fit simulates it, each of shape (N,)."""
    wanted = (state_vector.SPEED, state_vector.TWIST, state_vector.LOAD_SPEED)
    speed, twist, load_speed = (simulated(result, index, state) for state in wanted)
    if result.problem.grid.structure is Structure.ONE_MASS:
        load_speed = speed
    angle = motor_angle(result.problem.records[index])
    return {"angle": angle, "speed": speed, "twist": twist, "load_speed": load_speed}


def motion_in_blocks(record: Record, states: dict[str, FloatArray], length: int) -> Motion:
    """Return the means over blocks of a number of samples; what is left at the end is no block."""
    return Motion(
        block_mean(record.time_s, length),
        block_mean(record.total_torque_nm, length),
        **{name: block_mean(values, length) for name, values in states.items()},
    )


def between(values: FloatArray) -> FloatArray:
    """Return a sampled signal half a sample later, where the torque held from a sample on has its middle."""
    later = np.append(values[1:], 2.0 * values[-1] - values[-2])
    return 0.5 * (values + later)


class FormPlace(IntEnum):
    """Where a law whose form is in error acts: on the motor, against the load, in the shaft."""

    MOTOR = 0
    LOAD = 1
    SHAFT = 2


def form_changes(result: FitResult, index: int) -> FloatArray:
    """Return by how much the laws at each place change around each sample of a recording [Nm], shape (3, N)."""
    return _of_laws(result, index, change_around)


def form_shifts(result: FitResult, index: int) -> FloatArray:
    """Return what is missing at each place around a change of a law that comes late [Nm], shape (3, N)."""
    return _of_laws(result, index, change_across)


def _of_laws(result: FitResult, index: int, change_of: Callable[[FloatArray], FloatArray]) -> FloatArray:
    p, record = result.p_of(index), result.problem.records[index]
    found = np.zeros((len(FormPlace), record.time_s.size))
    structure = result.problem.grid.structure
    if structure is Structure.JOINT or result.problem.grid.plant is not None:
        return found
    if p[list(_MOTOR)].any():
        found[FormPlace.MOTOR] = change_of(_at_motor(simulated(result, index, state=state_vector.SPEED), p))
    if p[list(_LOAD)].any():
        state = state_vector.SPEED if structure is Structure.ONE_MASS else state_vector.LOAD_SPEED
        found[FormPlace.LOAD] = change_of(_at_load(simulated(result, index, state=state), record.since_start_s, p))
    if p[list(_SHAFT)].any():
        found[FormPlace.SHAFT] = change_of(_in_shaft(simulated(result, index, state=state_vector.TWIST), p))
    return np.where(np.isfinite(found), found, 0.0)


def _at_motor(speed: FloatArray, p: FloatArray) -> FloatArray:
    size = p[slots.COULOMB] + np.zeros(speed.size)
    if p[slots.STRIBECK_SPEED] > 0.0:
        size += p[slots.STRIBECK_COULOMB] + p[slots.STRIBECK] * np.exp(-((speed / p[slots.STRIBECK_SPEED]) ** 2))
    return size * np.sign(speed)


def _at_load(speed: FloatArray, since_start_s: FloatArray, p: FloatArray) -> FloatArray:
    braked = (p[slots.BRAKE_FROM] <= since_start_s) & (since_start_s <= p[slots.BRAKE_TO])
    return (p[slots.COULOMB_LOAD] + p[slots.BRAKE] * braked) * np.sign(speed)


def _in_shaft(twist: FloatArray, p: FloatArray) -> FloatArray:
    """Return what the shaft carries less than its spring would: up to half a gap's worth, and a stage's more."""
    half = 0.5 * p[slots.GAP]
    missing = np.clip(twist, -half, half)
    beyond = np.abs(twist) - half - p[slots.STAGE_FROM]
    more = p[slots.STAGE] * np.sign(twist) * np.maximum(beyond, 0.0)
    return p[slots.K] * (more - missing)


def change_around(law_nm: FloatArray) -> FloatArray:
    """Return the range of a torque over the samples around each one, shape (N,)."""
    padded = np.pad(law_nm, AROUND, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND + 1)
    return windows.max(axis=1) - windows.min(axis=1)


def change_across(law_nm: FloatArray) -> FloatArray:
    """Return the change of a torque from the first to the last of the samples around each one, shape (N,)."""
    padded = np.pad(law_nm, AROUND, mode="edge")
    return padded[2 * AROUND :] - padded[: law_nm.size]


def block_mean(values: FloatArray, length: int) -> FloatArray:
    """Average a signal of shape (N, ...) over blocks, shape (N // length, ...)."""
    count = values.shape[0] // length
    if length == 1:
        return values[:count]
    return values[: count * length].reshape(count, length, *values.shape[1:]).mean(axis=1)


def block_mean_of(values: FloatArray, use: BoolArray, length: int) -> tuple[FloatArray, FloatArray]:
    """Average the samples in use over blocks: the means, 0 where there are none, and how many there are; (B,)."""
    weight = block_mean(use.astype(float), length) * length
    total = block_mean(np.where(use, values, 0.0), length) * length
    return total / np.maximum(weight, 1.0), weight


class InputPlace(Enum):
    """Where an unknown input may act: on the motor, in the shaft, against the load, on the reading."""

    MOTOR = "motor"
    SHAFT = "shaft"
    LOAD = "load"
    SENSOR = "sensor"


FORCES = {
    InputPlace.MOTOR: (1.0, 0.0),
    InputPlace.SHAFT: (-1.0, -1.0),
    InputPlace.LOAD: (0.0, 1.0),
    InputPlace.SENSOR: (0.0, 0.0),
}
"""Torque on the motor and torque against the load per unit of the input."""

PLACES = {
    Element.TORQUE_PATH: InputPlace.MOTOR,
    Element.MOTOR: InputPlace.MOTOR,
    Element.SHAFT: InputPlace.SHAFT,
    Element.LOAD: InputPlace.LOAD,
    Element.SPEED_SENSOR: InputPlace.SENSOR,
    Element.ACQUISITION: InputPlace.SENSOR,
}
"""Where a law of an element acts."""

ELEMENTS = {
    InputPlace.MOTOR: Element.MOTOR,
    InputPlace.SHAFT: Element.SHAFT,
    InputPlace.LOAD: Element.LOAD,
    InputPlace.SENSOR: Element.SPEED_SENSOR,
}
"""The element that a place is reported as: an input alone does not distinguish those that act there."""


def places(result: FitResult) -> tuple[InputPlace, ...]:
    """Return the places at which an unknown input may act on a line of this structure."""
    if result.problem.grid.structure is Structure.JOINT:
        return (InputPlace.SHAFT,)
    if result.problem.grid.structure is Structure.ONE_MASS:
        return (InputPlace.MOTOR, InputPlace.SENSOR)
    return tuple(InputPlace)


def size_at(result: FitResult, place: InputPlace) -> float:
    """Return the usual size of an input at a place: a torque [Nm], or a speed [rad/s] at the sensor."""
    records = result.problem.records
    return speed_scale(records) if place is InputPlace.SENSOR else torque_scale(records)


@dataclass(frozen=True, slots=True)
class BlockedRecording:
    """One recording of a fit, in blocks."""

    record: Record  # as it was fitted
    length: int  # samples per block
    tangent: Tangent  # the line linearised around the fit
    error: FloatArray  # (B,): measured less simulated output, averaged over the block's good samples
    weight: FloatArray  # (B,): how many samples of the block count
    motion: Motion  # as the fit has it, in the middle of each block
    reading: Motion  # the same at the moments at which the output was read

    @property
    def okay(self) -> BoolArray:
        """Blocks with at least half their samples, shape (B,)."""
        return np.asarray(2 * self.weight >= self.length)

    @property
    def period_s(self) -> float:
        """Length of a block [s]."""
        return self.length * self.record.sample_time_s

    @property
    def size(self) -> int:
        """Number of blocks."""
        return int(self.error.size)


def lines(result: FitResult, length: int | None = None) -> tuple[BlockedRecording, ...]:
    """Return the recordings of a fit in blocks."""
    length = length or block_length(result)
    return tuple(concurrently(lambda i: _line(result, i, length), range(len(result.problem.records))))


def _line(result: FitResult, index: int, length: int) -> BlockedRecording:
    record = result.problem.records[index]
    error, weight = block_mean_of(record.output - result.outputs[index], result.problem.use[index], length)
    states = states_of(result, index)
    return BlockedRecording(
        record,
        length,
        tangent(result, index, length),
        error,
        weight,
        motion_in_blocks(record, {name: between(values) for name, values in states.items()}, length),
        motion_in_blocks(record, states, length),
    )
