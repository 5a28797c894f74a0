"""The linearised driveline: what a small torque at motor or load does to the output.

Block by block of samples; one block stands for all where the line is linear and does not change with time::

    x[b+1] = phi[b] x[b] + gamma[b] u[b]      x: change of the state at the start of block b
    y[b]   = c[b] x[b] + d[b] u[b]            u: torque on the motor, torque against the load, held over the block
                                              y: change of the output, averaged over the block's samples
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimator.compiled import compiled
from estimator.signals.record import FloatArray

MOTOR, LOAD = 0, 1
"""Columns of the inputs: torque on the motor shaft, and torque against the load."""


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

    def answers(self, motor: float, load: float, torques_nm: FloatArray) -> FloatArray:
        """Return the output's answers to torques from rest, each at the motor and at the load in two shares; (q, B)."""
        found = np.empty_like(torques_nm)
        respond_each(self.phi, self.gamma, self.c, self.d, motor, load, torques_nm, found)
        return found

    def free(self, blocks: int) -> FloatArray:
        """Return the output's answer to each initial state of its size in use, shape (n, blocks)."""
        nothing = np.zeros(blocks)
        starts = np.diag(self.scale)
        return np.array([respond(self.phi, self.gamma, self.c, self.d, nothing, nothing, x) for x in starts])


@compiled
def respond_each(
    phi: FloatArray,
    gamma: FloatArray,
    c: FloatArray,
    d: FloatArray,
    motor: float,
    load: float,
    torques_nm: FloatArray,
    found: FloatArray,
) -> None:
    """Do what ``respond`` does for every row of torques (q, B), from rest, into a row of ``found``."""
    rest = np.zeros(phi.shape[1])
    for i in range(torques_nm.shape[0]):
        torque_nm = torques_nm[i]
        acting = np.flatnonzero(torque_nm)
        found[i] = 0.0
        if acting.size > 0:
            begin = acting[0]  # at rest before
            rows = slice(begin, None) if phi.shape[0] > 1 else slice(None)
            given = (phi[rows], gamma[rows], c[rows], d[rows])
            found[i, begin:] = respond(*given, motor * torque_nm[begin:], load * torque_nm[begin:], rest)


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
