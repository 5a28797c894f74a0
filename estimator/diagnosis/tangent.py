"""The driveline of a fit, linearised along its own simulation: what a small torque at motor or load does to the output.

The compiled kernel itself is differentiated, block by block of samples, so that whatever law is in the model is in the
tangent too. A line without laws beyond the nominal ones is linear; one block then stands for all::

    x[b+1] = phi[b] x[b] + gamma[b] u[b]      x: change of the state at the start of block b
    y[b]   = c[b] x[b] + d[b] u[b]            u: torque on the motor, torque against the load, held over the block
                                              y: change of the output, averaged over the block's samples
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.compiled import compiled
from estimator.physics import kernel
from estimator.physics.catalogue import BUILT_IN
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, start_of
from estimator.physics.layout import slot
from estimator.physics.model import Structure, natural_frequencies_rad_s
from estimator.physics.motion import speed_scale, torque_scale
from estimator.physics.simulate import MASSES, initial_state, motor_angle, output_state
from estimator.physics.torque_path import shaft_torque
from estimator.signals.record import FloatArray, OutputKind

NUDGE = 1e-5
"""Size of a difference step, as a share of the speed or torque in use."""

MOTOR, LOAD = 0, 1
"""Columns of the inputs: torque on the motor shaft, and torque against the load."""

LONGEST_BLOCK_S = 0.01
BLOCKS_PER_PERIOD = 12.0
"""Samples closer together than this many per period of the line's fastest mode are averaged."""


@dataclass(frozen=True, slots=True)
class Tangent:
    """A linearised line of n states over B blocks; the first dimension is 1 where one block stands for all.

    Attributes
    ----------
    phi : ndarray, shape (B, n, n)
    gamma : ndarray, shape (B, n, 2)
    c : ndarray, shape (B, n)
    d : ndarray, shape (B, 2)
    states : tuple of int
        Which entries of the kernel's state the n are.
    scale : ndarray, shape (n,)
        Size of each state in use, in its unit.
    """

    phi: FloatArray
    gamma: FloatArray
    c: FloatArray
    d: FloatArray
    states: tuple[int, ...]
    scale: FloatArray

    def part(self, rows: slice) -> Tangent:
        """Return the tangent of some of the blocks."""
        if self.phi.shape[0] == 1:
            return self
        phi, gamma, c, d = (np.ascontiguousarray(a[rows]) for a in (self.phi, self.gamma, self.c, self.d))
        return Tangent(phi, gamma, c, d, self.states, self.scale)

    def answer(self, motor_nm: FloatArray, load_nm: FloatArray) -> FloatArray:
        """Return the output's answer to torques on the motor and against the load from rest; all of shape (B,)."""
        return respond(self.phi, self.gamma, self.c, self.d, motor_nm, load_nm, np.zeros(len(self.states)))

    def free(self, blocks: int) -> FloatArray:
        """Return the output's answer to each initial state of its size in use, shape (n, blocks)."""
        nothing = np.zeros(blocks)
        starts = np.diag(self.scale)
        return np.array([respond(self.phi, self.gamma, self.c, self.d, nothing, nothing, x) for x in starts])


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
    record, basis, p = problem.records[index], problem.local[index], result.p_of(index)
    p = p.copy()
    p[kernel.QUANTISATION] = 0.0  # steps have no slope; their size is noise here
    start = start_of(problem, result.x, index)
    torque = shaft_torque(record.torque_nm, record.time_s - record.time_s[0], p)
    load = np.full(torque.shape, start.load_torque_nm)
    extra = basis.extra_load(result.local_of(index))
    if extra is not None:
        load += extra
    angle = motor_angle(record)
    blocks = record.time_s.size // length
    if is_linear(p):
        blocks = min(blocks, 1)
    direct = p.copy()
    direct[[kernel.DELAY, kernel.LAG, kernel.DRIFT]] = 0.0  # a disturbance acts on the shaft, behind the torque path
    output = output_state(record, problem.grid.structure)
    states = active_states(problem.grid.structure, p, record.kind)
    scale = _scales(result, states)
    n = len(states)
    phi, gamma = np.empty((blocks, n, n)), np.empty((blocks, n, 2))
    c, d = np.empty((blocks, n)), np.empty((blocks, 2))
    linearise(
        MASSES[problem.grid.structure],
        record.sample_time_s,
        problem.grid.substeps,
        problem.grid.sign_width,
        torque,
        load,
        angle,
        p,
        direct,
        initial_state(start, torque[0], angle[0], p),
        output,
        output != kernel.ANGLE,
        np.array(states),
        NUDGE * scale,
        NUDGE * torque_scale([record]),
        length,
        phi,
        gamma,
        c,
        d,
    )
    return Tangent(phi, gamma, c, d, states, scale)


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


def is_linear(p: FloatArray) -> bool:
    """Tell whether a parameter vector is that of a linear line that does not change with time."""
    return all(p[i] == null for i, null in _NONLINEAR)


def active_states(structure: Structure, p: FloatArray, kind: OutputKind) -> tuple[int, ...]:
    """Return which entries of the kernel's state can move the output of a model."""
    states = [kernel.ANGLE] if kind is OutputKind.POSITION else []
    states.append(kernel.SPEED)
    if structure is not Structure.ONE_MASS:
        states += [kernel.TWIST, kernel.LOAD_SPEED]
    names = kernel.State._fields
    if structure is Structure.THREE_MASS:
        states += [names.index("middle_twist"), names.index("middle_speed")]
    if p[kernel.SLIDER] != 0.0:
        states.append(names.index("loading"))
    if p[kernel.SLIP] > 0.0:
        states.append(names.index("vehicle_speed"))
    if p[kernel.BRANCH_INERTIA] > 0.0:
        states += [names.index("branch_twist"), names.index("branch_speed")]
    if p[kernel.FILTER] > 0.0:
        states.append(kernel.FILTERED)
    return tuple(states)


def _scales(result: FitResult, states: tuple[int, ...]) -> FloatArray:
    records = result.problem.records
    speed, torque = speed_scale(records), torque_scale(records)
    stiffness = float(result.p[slot("", "k")])
    twist = torque / stiffness if stiffness > 0.0 else 1.0
    names = kernel.State._fields
    sizes = dict.fromkeys(range(kernel.STATES), speed)
    sizes |= {names.index(name): twist for name in ("twist", "branch_twist", "middle_twist")}
    sizes |= {names.index("loading"): 1.0, kernel.ANGLE: 1.0}
    return np.array([sizes[state] for state in states])


@compiled
def linearise(
    masses: int,
    sample_time_s: float,
    substeps: int,
    sign_width: float,
    torque: FloatArray,
    load: FloatArray,
    angle: FloatArray,
    p: FloatArray,
    direct: FloatArray,
    start: FloatArray,
    output: int,
    sensor: bool,
    states: FloatArray,
    steps: FloatArray,
    step_nm: float,
    length: int,
    phi: FloatArray,
    gamma: FloatArray,
    c: FloatArray,
    d: FloatArray,
) -> None:
    """Fill the tangent by differences of the kernel over each block; see ``kernel.integrate`` for the arguments.

    Parameters
    ----------
    direct : ndarray, shape (layout.SIZE,)
        Parameters without delay and lag in the torque path.
    states : ndarray of int, shape (n,)
        Entries of the state that are moved, by ``steps`` each.
    step_nm : float
        By how much the torques are moved [Nm].
    """
    n = states.shape[0]
    out = np.zeros(torque.shape[0])
    slopes = np.zeros((2, 0))
    base = start.copy()
    moving_torque, moving_load = torque.copy(), load.copy()
    for block in range(phi.shape[0]):
        first, last = block * length, (block + 1) * length
        t, w, a = moving_torque[:last], moving_load[:last], angle[:last]
        before = base.copy()
        kernel.integrate(
            masses, sample_time_s, substeps, sign_width, first, 0.0, t, w, a, p, base, output, sensor, out, slopes
        )
        mean = out[first:last].mean()
        for i in range(n):
            moved = before.copy()
            moved[states[i]] += steps[i]
            kernel.integrate(
                masses, sample_time_s, substeps, sign_width, first, 0.0, t, w, a, p, moved, output, sensor, out, slopes
            )
            c[block, i] = (out[first:last].mean() - mean) / steps[i]
            for j in range(n):
                phi[block, j, i] = (moved[states[j]] - base[states[j]]) / steps[i]
        rest = before.copy()
        kernel.integrate(
            masses, sample_time_s, substeps, sign_width, first, 0.0, t, w, a, direct, rest, output, sensor, out, slopes
        )
        rest_mean = out[first:last].mean()
        for i in range(2):
            moved = before.copy()
            if i == 0:
                t[first:last] += step_nm
            else:
                w[first:last] += step_nm
            kernel.integrate(
                masses,
                sample_time_s,
                substeps,
                sign_width,
                first,
                0.0,
                t,
                w,
                a,
                direct,
                moved,
                output,
                sensor,
                out,
                slopes,
            )
            t[first:last] = torque[first:last]
            w[first:last] = load[first:last]
            d[block, i] = (out[first:last].mean() - rest_mean) / step_nm
            for j in range(n):
                gamma[block, j, i] = (moved[states[j]] - rest[states[j]]) / step_nm


@compiled
def respond(
    phi: FloatArray,
    gamma: FloatArray,
    c: FloatArray,
    d: FloatArray,
    motor_nm: FloatArray,
    load_nm: FloatArray,
    start: FloatArray,
) -> FloatArray:
    """Return the output of a tangent, shape (B,), under torques of shape (B,) from a state of shape (n,)."""
    n = start.shape[0]
    varying = phi.shape[0] > 1
    x, moved = start.copy(), np.empty(n)
    y = np.empty(motor_nm.shape[0])
    for b in range(motor_nm.shape[0]):
        i = b if varying else 0
        total = d[i, 0] * motor_nm[b] + d[i, 1] * load_nm[b]
        for row in range(n):
            total += c[i, row] * x[row]
            value = gamma[i, row, 0] * motor_nm[b] + gamma[i, row, 1] * load_nm[b]
            for column in range(n):
                value += phi[i, row, column] * x[column]
            moved[row] = value
        for row in range(n):
            x[row] = moved[row]
        y[b] = total
    return y
