"""The driveline of a fit, linearised along its own simulation, whatever law is in the model."""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.line.differences import Nudges, Setting, linearise
from estimator.diagnosis.line.tangent import Tangent
from estimator.physics.acting import Place
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.inputs import initial_state
from estimator.physics.kernel import slots, state_vector
from estimator.physics.kernel.line import is_bristled_at_load, is_bristled_at_motor
from estimator.physics.layout import LOAD, slot
from estimator.physics.model import Structure, natural_frequencies_rad_s
from estimator.physics.motion import motor_angle, speed_scale, torque_scale
from estimator.physics.problem import start_of
from estimator.physics.simulate import MASSES, output_state
from estimator.physics.torque_path import shaft_torque
from estimator.signals.record import FloatArray, OutputKind, Record

NUDGE = 1e-5
"""Size of a difference step, as a share of the speed or torque in use."""

LONGEST_BLOCK_S = 0.01
BLOCKS_PER_PERIOD = 12.0
"""Samples closer together than this many per period of the line's fastest mode are averaged."""


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
    """Linearise one recording of a fit.

    Parameters
    ----------
    length : int
        Samples per block; what does not fill a block at the end is left out.

    Returns
    -------
    Tangent
        Of ``N // length`` blocks, or of one where the model is linear.
    """
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
        _load(result, index, start.load_torque_nm + float(p[slot("", LOAD)])),
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
    """Return the load torque of one recording at a fit, shape (N,)."""
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


_NONLINEAR = tuple(
    (slot(entry.name, parameter.name), parameter.null)
    for entry in BUILT_IN.values()
    if entry.element not in (Element.TORQUE_PATH, Element.ACQUISITION) and not entry.profile
    for parameter in entry.parameters[:1]
)
"""Decisive parameter of each effect that changes how the line answers to a torque behind the torque path."""


_BY_ANGLE = [
    slot(entry.name, entry.parameters[0].name)
    for entry in BUILT_IN.values()
    if entry.acting is not None and entry.acting.place is Place.LOAD_ANGLE
]
"""Sizes of the laws by which the motion depends on where it is."""


def is_linear(p: FloatArray) -> bool:
    """Tell whether a parameter vector is that of a linear line that does not change with time."""
    return all(p[i] == null for i, null in _NONLINEAR)


_MOVED_BY = {
    slots.SLIDER: (state_vector.State._fields.index("loading"),),
    slots.SLIP: (state_vector.VEHICLE_SPEED,),
    slots.RELAXING: (state_vector.RELAXING,),
    slots.BRANCH_INERTIA: (state_vector.BRANCH_TWIST, state_vector.BRANCH_SPEED),
    slots.FILTER: (state_vector.FILTERED,),
    slots.FILTER_SHAPE: (state_vector.FILTER_RISE,),
}
"""States that a law has of its own, by its size."""


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
