"""The linearised driveline: what a small torque at motor or load does to the output.

Block by block of samples; one block stands for all where the line is linear and does not change with time::

    x[b+1] = phi[b] x[b] + gamma[b] u[b]      x: change of the state at the start of block b
    y[b]   = c[b] x[b] + d[b] u[b]            u: torque on the motor, torque against the load, held over the block
                                              y: change of the output, averaged over the block's samples
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, ir_inlined
from estimator.physics import layout
from estimator.physics.catalogue import BUILT_IN, KERNEL
from estimator.physics.effect import Element, Place
from estimator.physics.fit import FitResult
from estimator.physics.inputs import initial_state, shaft_torque
from estimator.physics.kernel import integration, slots, state_vector
from estimator.physics.kernel.conditions import is_bristled_at_load, is_bristled_at_motor
from estimator.physics.kernel.integration import Masses
from estimator.physics.layout import slot
from estimator.physics.model import Structure, natural_frequencies_rad_s
from estimator.physics.motion import motor_angle, speed_scale, torque_scale
from estimator.physics.problem import start_of
from estimator.physics.simulate import MASSES, output_state
from estimator.signals.record import FloatArray, OutputKind, Record

MOTOR, LOAD = 0, 1  # columns of the inputs: torque on the motor shaft, and torque against the load

NUDGE = 1e-5  # size of a difference step, as a share of the speed or torque in use

LONGEST_BLOCK_S = 0.01
BLOCKS_PER_PERIOD = 12.0
"""Samples closer together than this many per period of the line's fastest mode are averaged."""

_NONLINEAR = tuple(
    (slot(entry.name, parameter.name), parameter.null)
    for entry in KERNEL.values()
    if entry.element not in (Element.TORQUE_PATH, Element.ACQUISITION) and not entry.profile
    for parameter in entry.parameters[:1]
)
"""Decisive parameter of each effect that changes how the line answers to a torque behind the torque path; of a table
how many knots it has."""

_BY_ANGLE = [
    slot(entry.name, entry.parameters[0].name)
    for entry in BUILT_IN.values()
    if entry.acting is not None and entry.acting.place is Place.LOAD_ANGLE
]
"""Sizes of the laws by which the motion depends on where it is."""

_MOVED_BY = {
    slots.SLIDER: (state_vector.State._fields.index("loading"),),
    slots.SLIP: (state_vector.VEHICLE_SPEED,),
    slots.RELAXING: (state_vector.RELAXING,),
    slots.BRANCH_INERTIA: (state_vector.BRANCH_TWIST, state_vector.BRANCH_SPEED),
    slots.FILTER: (state_vector.FILTERED,),
    slots.FILTER_SHAPE: (state_vector.FILTER_RISE,),
}
"""States that a law has of its own, by its size."""


@dataclass(frozen=True, slots=True)
class Tangent:
    """A linearised line of n states over B blocks; the first dimension is 1 where one block stands for all."""

    phi: FloatArray  # (B, n, n)
    gamma: FloatArray  # (B, n, 2)
    c: FloatArray  # (B, n)
    d: FloatArray  # (B, 2)
    states: tuple[int, ...]  # which entries of the kernel's state the n are
    scale: FloatArray  # (n,): size of each state in use, in its unit


class Setting(NamedTuple):
    """What the kernel is given in every block alike, and room for its answers; see ``integration.integrate``."""

    masses: Masses  # which structure the kernel is compiled for
    sample_time_s: float  # from row to row
    substeps: int  # steps of integration in a sample
    sign_width: float  # speed within which dry friction changes sign [rad/s]
    angle: FloatArray  # (N,): of the motor, as recorded [rad]
    outputs: NDArray[np.int_]  # entries of the state to read out; the first is the recorded one
    sensor: bool  # whether the speed sensor's effects act on the first of them
    out: FloatArray  # (outputs, N): filled by the kernel
    slopes: FloatArray  # (2, N): the torque's changes within a sample; (2, 0): not wanted


class Nudges(NamedTuple):
    """What is moved, and by how much."""

    states: NDArray[np.int_]  # (n,): entries of the kernel's state
    steps: FloatArray  # (n,): by how much each, in its unit
    step_nm: float  # by how much the torques [Nm]


Torques = tuple[FloatArray, FloatArray]
"""Torque on the motor shaft and load torque from the first sample to the end of a block."""


@compiled
def linearise(
    setting: Setting,
    nudges: Nudges,
    torque: FloatArray,
    load: FloatArray,
    p: FloatArray,
    direct: FloatArray,
    start: FloatArray,
    blocks: int,
    length: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return ``phi``, ``gamma``, ``c`` and ``d`` of a tangent by differences of the kernel over each block."""
    n = nudges.states.shape[0]
    phi, gamma = np.empty((blocks, n, n)), np.empty((blocks, n, 2))
    c, d = np.empty((blocks, n)), np.empty((blocks, 2))
    state = start.copy()
    moving_torque, moving_load = torque.copy(), load.copy()
    for block in range(blocks):
        first, last = block * length, (block + 1) * length
        torques = (moving_torque[:last], moving_load[:last])
        by_torques(setting, nudges, first, torques, direct, state, gamma[block], d[block])
        by_states(setting, nudges, first, torques, p, state, phi[block], c[block])
    return phi, gamma, c, d


@ir_inlined
def by_states(
    setting: Setting,
    nudges: Nudges,
    first: int,
    torques: Torques,
    p: FloatArray,
    state: FloatArray,
    phi: FloatArray,
    c: FloatArray,
) -> None:
    """Fill what a block makes of a change of its first state; leave in ``state`` its last."""
    before = state.copy()
    mean = run_block(setting, first, torques, p, state)
    for i in range(nudges.states.shape[0]):
        moved = before.copy()
        moved[nudges.states[i]] += nudges.steps[i]
        c[i] = (run_block(setting, first, torques, p, moved) - mean) / nudges.steps[i]
        for j in range(nudges.states.shape[0]):
            phi[j, i] = (moved[nudges.states[j]] - state[nudges.states[j]]) / nudges.steps[i]


@ir_inlined
def by_torques(
    setting: Setting,
    nudges: Nudges,
    first: int,
    torques: Torques,
    p: FloatArray,
    state: FloatArray,
    gamma: FloatArray,
    d: FloatArray,
) -> None:
    """Fill what a block makes of a torque on the motor and of one against the load, held over it."""
    rest = state.copy()
    mean = run_block(setting, first, torques, p, rest)
    for i in range(2):
        moved, held = state.copy(), torques[i][first:].copy()
        torques[i][first:] += nudges.step_nm
        d[i] = (run_block(setting, first, torques, p, moved) - mean) / nudges.step_nm
        torques[i][first:] = held
        for j in range(nudges.states.shape[0]):
            gamma[j, i] = (moved[nudges.states[j]] - rest[nudges.states[j]]) / nudges.step_nm


@ir_inlined
def run_block(setting: Setting, first: int, torques: Torques, p: FloatArray, state: FloatArray) -> float:
    """Simulate a block from ``state``, leave there its last state, and return its mean output."""
    torque, load = torques
    integration.integrate(
        setting.masses,
        (),
        setting.sample_time_s,
        setting.substeps,
        setting.sign_width,
        first,
        torque.shape[0],
        0.0,
        torque,
        load,
        setting.angle,
        setting.angle[:0],
        p,
        state,
        setting.outputs,
        setting.sensor,
        setting.out,
        setting.slopes,
    )
    return setting.out[0, first : torque.shape[0]].mean()


def block_length(result: FitResult) -> int:
    """Return how many samples of a fit's recordings make a block: 1 where they are as far apart as the line needs."""
    sample_time_s = result.problem.records[0].sample_time_s
    structure = result.problem.grid.structure
    values = {name: float(result.p[slot("", name)]) for name in structure.parameter_names}
    fastest = float(natural_frequencies_rad_s(values)[-1])
    longest_s = LONGEST_BLOCK_S
    if fastest > 0.0:
        longest_s = min(longest_s, 2.0 * np.pi / (BLOCKS_PER_PERIOD * fastest))
    return max(1, int(longest_s / sample_time_s))


def tangent(result: FitResult, index: int, length: int) -> Tangent:
    """Linearise one recording of a fit."""
    problem = result.problem
    if problem.grid.structure is Structure.JOINT:
        return _of_joint(result)
    record, p = problem.records[index], result.p_of(index).copy()
    p[slots.QUANTISATION] = 0.0  # steps have no slope; their size is noise here
    direct = p.copy()
    direct[[slots.DELAY, slots.LAG, slots.DRIFT]] = 0.0  # a disturbance acts on the shaft, behind the torque path
    start, angle = start_of(problem, result.x, index), motor_angle(record)
    torque = shaft_torque(record.torque_nm, record.time_s - record.time_s[0], p)
    states = active_states(problem.grid.structure, p, record.kind)
    scale = _scales(result, states)
    blocks = record.time_s.size // length
    phi, gamma, c, d = linearise(
        _setting(result, record, angle),
        Nudges(np.array(states), NUDGE * scale, NUDGE * torque_scale([record])),
        torque,
        _load(result, index, start.load_torque_nm + float(p[slot("", layout.LOAD)])),
        p,
        direct,
        initial_state(start, torque[0], angle[0], p),
        min(blocks, 1) if is_linear(p) else blocks,
        length,
    )
    return Tangent(phi, gamma, c, d, states, scale)


def _setting(result: FitResult, record: Record, angle: FloatArray) -> Setting:
    grid = result.problem.grid
    output = output_state(record, grid.structure)
    return Setting(
        masses=MASSES[grid.structure],
        sample_time_s=record.sample_time_s,
        substeps=grid.substeps,
        sign_width=grid.sign_width,
        angle=angle,
        outputs=np.array([output]),
        sensor=output != state_vector.ANGLE,
        out=np.zeros((1, angle.size)),
        slopes=np.zeros((2, 0)),  # no room: not wanted
    )


def _load(result: FitResult, index: int, constant_nm: float) -> FloatArray:
    record = result.problem.records[index]
    load = np.full(record.time_s.size, constant_nm) + record.known_load_nm
    extra = result.problem.local[index].extra_load(result.local_of(index))
    return load if extra is None else load + extra


def _of_joint(result: FitResult) -> Tangent:
    """Return the tangent of a joint: its motion is imposed, a torque against the load is missing in what it takes."""
    states = active_states(Structure.JOINT, result.p, OutputKind.FORCE)
    n = len(states)
    at_output = np.array([[0.0, -1.0]])
    return Tangent(
        np.zeros((1, n, n)), np.zeros((1, n, 2)), np.zeros((1, n)), at_output, states, _scales(result, states)
    )


def is_linear(p: FloatArray) -> bool:
    """Tell whether a parameter vector is that of a linear line that does not change with time."""
    return all(p[i] == null for i, null in _NONLINEAR)


def active_states(structure: Structure, p: FloatArray, kind: OutputKind) -> tuple[int, ...]:
    """Return which entries of the kernel's state can move the output of a model."""
    held = (p[_BY_ANGLE] != 0.0).any()
    states = [state_vector.ANGLE] if kind is OutputKind.POSITION or held else []
    states.append(state_vector.SPEED)
    if structure is not Structure.ONE_MASS:
        states += [state_vector.TWIST, state_vector.LOAD_SPEED]
    names = state_vector.State._fields
    if structure is Structure.THREE_MASS:
        states += [names.index("middle_twist"), names.index("middle_speed")]
    states += [state for size, moved in _MOVED_BY.items() if p[size] > 0.0 for state in moved]
    if is_bristled_at_motor(p):
        states.append(state_vector.BRISTLES_MOTOR)
    if is_bristled_at_load(p):
        states.append(state_vector.BRISTLES_LOAD)
    return tuple(states)


def _scales(result: FitResult, states: tuple[int, ...]) -> FloatArray:
    records = result.problem.records
    speed, torque = speed_scale(records), torque_scale(records)
    stiffness = float(result.p[slot("", "k")])
    twist = torque / stiffness if stiffness > 0.0 else 1.0
    names = state_vector.State._fields
    sizes = dict.fromkeys(range(state_vector.STATES), speed)
    sizes |= {names.index(name): twist for name in ("twist", "branch_twist", "middle_twist")}
    sizes |= {names.index("loading"): 1.0, state_vector.ANGLE: 1.0}
    sizes |= dict.fromkeys((state_vector.RELAXING, state_vector.BRISTLES_MOTOR, state_vector.BRISTLES_LOAD), torque)
    return np.array([sizes[state] for state in states])
