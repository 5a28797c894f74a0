"""The compiled kernel differentiated along a simulation, block by block of samples.

Each block is simulated as it was, and once more for every state and every torque moved a little.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimator.compiled import compiled, ir_inlined
from estimator.physics.kernel import integration
from estimator.physics.kernel.makes import Masses
from estimator.signals.record import FloatArray


class Setting(NamedTuple):
    """What the kernel is given in every block alike, and room for its answers; see ``integration.integrate``."""

    masses: Masses
    sample_time_s: float
    substeps: int
    sign_width: float
    angle: FloatArray
    outputs: NDArray[np.int_]
    sensor: bool
    out: FloatArray
    slopes: FloatArray


class Nudges(NamedTuple):
    """What is moved, and by how much.

    Attributes
    ----------
    states : ndarray of int, shape (n,)
        Entries of the kernel's state.
    steps : ndarray, shape (n,)
        By how much each, in its unit.
    step_nm : float
        By how much the torques [Nm].
    """

    states: NDArray[np.int_]
    steps: FloatArray
    step_nm: float


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
    """Return ``phi``, ``gamma``, ``c`` and ``d`` of a tangent by differences of the kernel over each block.

    Parameters
    ----------
    torque, load : ndarray, shape (N,)
        Torque on the motor shaft and load torque [Nm].
    p, direct : ndarray, shape (layout.SIZE,)
        Parameters of the superset model, and the same without delay and lag in the torque path.
    start : ndarray, shape (STATES,)
        State at the first sample.
    length : int
        Samples per block.
    """
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
        p,
        state,
        setting.outputs,
        setting.sensor,
        setting.out,
        setting.slopes,
    )
    mean: float = setting.out[0, first : torque.shape[0]].mean()
    return mean
