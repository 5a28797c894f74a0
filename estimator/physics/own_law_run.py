"""The compiled simulation under a user's own laws, which it can't hold: both are solved in turn until they agree.

A law is a function of the motion, and the motion follows from the law. From block to block of samples the line is
simulated under the torques so far, the laws give new torques from that motion, and so on to a fixed point (waveform
relaxation: Lelarasmee, Ruehli, Sangiovanni-Vincentelli, IEEE Trans. CAD 1, 1982). On a block of length h a torque whose
slope over a speed is s, at an inertia J, comes closer by about ``s h / J`` each time; where that is too slow the block
is cut. A law's torque is held over an integration step, of which a recorded sample holds several, and is taken at the
mean of the motion before and behind it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.compiled import compiled
from estimator.physics.effect import Element
from estimator.physics.kernel import integration, state_vector
from estimator.physics.kernel.makes import Masses
from estimator.physics.law_name import LawName
from estimator.signals.record import FloatArray, Record

BLOCK = 64
"""Integration steps of the longest block: a round over it costs little more than one over a single step."""

AGREED = 1e-11
"""Change of a torque, over its size, at which it has been found: a fit differentiates by steps of 1e-5."""

ROUNDS = 15
CLOSER = 0.5
"""A block is halved after so many rounds, or where from its second round on one brings law and motion not this much
closer."""

CALM = 8
"""Blocks that agree before a longer one is tried."""

_FORCES = {Element.MOTOR: (-1.0, 0.0), Element.SHAFT: (-1.0, -1.0), Element.LOAD: (0.0, 1.0)}
"""Torque on the motor and torque against the load per unit of a law's torque."""


@dataclass(frozen=True, slots=True)
class Run:
    """A simulation of one recording on its integration steps, ``substeps`` to a sample; S steps in all.

    Attributes
    ----------
    step_s : float
        Length of a step [s].
    time_s : ndarray, shape (S,)
        Time since the recording began, at the start of each step [s].
    torque, load, angle : ndarray, shape (S,)
        Torque on the motor and against the load [Nm], and motor angle [rad], without the laws.
    reading : ndarray, shape (S,)
        Torque reading that laws are given [Nm].
    p : ndarray
        Parameter vector.
    """

    masses: Masses
    sign_width: float
    step_s: float
    time_s: FloatArray
    torque: FloatArray
    load: FloatArray
    angle: FloatArray
    reading: FloatArray
    p: FloatArray

    @classmethod
    def of(
        cls,
        masses: Masses,
        substeps: int,
        sign_width: float,
        record: Record,
        torque: FloatArray,
        load: FloatArray,
        angle: FloatArray,
        p: FloatArray,
    ) -> Run:
        """Spread the signals of a recording, shape (N,) each, over its integration steps."""
        rows = np.arange(torque.size * substeps) / substeps
        step_s = record.sample_time_s / substeps
        ahead = np.append(angle, 2.0 * angle[-1] - angle[-2])  # the angle goes straight on behind the last sample
        return cls(
            masses,
            sign_width,
            step_s,
            record.since_start_s[0] + rows * record.sample_time_s,
            np.repeat(torque, substeps),
            np.repeat(load, substeps),
            np.interp(rows, np.arange(ahead.size), ahead),
            np.repeat(record.total_torque_nm, substeps),
            p,
        )

    def under(self, laws: Sequence[LawName], begin: FloatArray) -> Run:
        """Return the run with the laws' torques in its own.

        Where law and motion do not come to agree even over one step (a slope above inertia over step), the rest is NaN:
        such parameters are no solution.

        Raises
        ------
        BadModel
            Where a law fails or returns what is no number.
        """
        laws = [law for law in laws if law.law.element in _FORCES]
        if not laws:
            return self
        torque, load, state = self.torque.copy(), self.load.copy(), begin.copy()
        first, length, calm, held = 0, BLOCK, 0, np.zeros(2)
        while first < torque.size:
            last = min(first + length, torque.size)
            found = self._agreed(laws, torque[:last], load[:last], state, first, held)
            if found is not None:
                forces, state = found
                torque[first:last] += forces[0]
                load[first:last] += forces[1]
                first, held, calm = last, forces[:, -1], calm + 1
                if calm >= CALM:
                    length, calm = min(2 * length, BLOCK), 0
            elif length > 1:
                length, calm = length // 2, 0
            else:
                torque[first:] = load[first:] = np.nan
                break
        return replace(self, torque=torque, load=load)

    def _agreed(
        self,
        laws: Sequence[LawName],
        torque: FloatArray,
        load: FloatArray,
        begin: FloatArray,
        first: int,
        held: FloatArray,
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return the laws' torques on motor and load from step ``first`` on, shape (2, steps), and the state behind.

        None where they do not agree with the motion.
        """
        forces = np.tile(held[:, np.newaxis], torque.size - first)
        driven, loaded = torque.copy(), load.copy()
        before = np.inf
        for turn in range(ROUNDS):
            driven[first:] = torque[first:] + forces[0]
            loaded[first:] = load[first:] + forces[1]
            motion, state = self._motion(driven, loaded, begin, first)
            asked = self._forces(laws, 0.5 * (motion[:, 1:] + motion[:, :-1]), slice(first, torque.size))
            apart, size = float(np.abs(asked - forces).max()), float(np.abs(asked).max())
            if apart <= AGREED * size:
                return asked, state
            if not apart < (CLOSER * before if turn > 1 else np.inf):  # NaN, too
                return None
            forces, before = asked, apart
        return None

    def _motion(
        self, torque: FloatArray, load: FloatArray, begin: FloatArray, first: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return what laws are given of the motion at each step from ``first`` on and behind the last, (3, steps + 1).

        And the state there. With one mass the load moves as the motor does, and nothing twists.
        """
        motion, state = np.zeros((3, torque.size - first + 1)), np.empty_like(begin)
        trajectory(
            self.masses, self.step_s, 1, self.sign_width, first, self.time_s[0], torque, load,
            self.angle[: torque.size], self.p, begin, state, False, motion,
        )  # fmt: skip
        return motion, state

    def _arguments(self, motion: FloatArray, steps: slice, later: float) -> FloatArray:
        """Return the arguments of a law, shape (5, steps); ``later`` by this share of a step."""
        return np.vstack([self.time_s[steps] + later * self.step_s, motion, self.reading[steps]])

    def _forces(self, laws: Sequence[LawName], motion: FloatArray, steps: slice) -> FloatArray:
        arguments = self._arguments(motion, steps, 0.5)
        forces = np.zeros((2, motion.shape[1]))
        for law in laws:
            forces += np.outer(_FORCES[law.law.element], law.law(arguments, law.values(self.p)))
        return forces

    def misread(self, laws: Sequence[LawName], begin: FloatArray) -> FloatArray:
        """Return the error that the laws at the sensor add to the reading, shape (S,)."""
        laws = [law for law in laws if law.law.element is Element.SPEED_SENSOR]
        error = np.zeros_like(self.torque)
        if laws:
            motion, _ = self._motion(self.torque, self.load, begin, 0)
            arguments = self._arguments(motion[:, :-1], slice(None), 0.0)
            for law in laws:
                error += law.law(arguments, law.values(self.p))
        return error


@compiled
def trajectory(
    masses: Masses,
    step_s: float,
    substeps: int,
    sign_width: float,
    first: int,
    start_s: float,
    torque: FloatArray,
    load: FloatArray,
    angle: FloatArray,
    p: FloatArray,
    begin: FloatArray,
    state: FloatArray,
    sensor: bool,
    motion: FloatArray,
) -> None:
    """Fill ``motion``, shape (3, S - first + 1), with motor speed, load speed and twist, and the state behind them.

    ``substeps`` and ``sensor``, 1 and False, come from outside: for constants the whole kernel would be compiled anew.
    """
    outputs = np.array([state_vector.SPEED, state_vector.LOAD_SPEED, state_vector.TWIST])
    out = np.empty((outputs.size, torque.shape[0]))
    given, driven = (step_s, substeps, sign_width, first, torque.shape[0], start_s), (torque, load, angle, p, state)
    state[:] = begin
    integration.integrate(masses, *given, *driven, outputs, sensor, out, np.zeros((2, 0)))
    motion[:, :-1] = out[:, first:]
    for row in range(outputs.size):
        motion[row, -1] = state[outputs[row]]
    if len(masses) == 1:
        motion[1] = motion[0]
