"""How far a law may be off by its form: the torque by which it changes at a moment, at its place in the line.

No real friction or gap follows an equation. Where the law of one jumps, at a reversal or where faces meet, the torque
is off by a share of that jump, for some samples, whatever its parameters; elsewhere the law and the real one are alike.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from estimator.diagnosis.line.motion import simulated
from estimator.physics.fit import FitResult
from estimator.physics.kernel import slots, state_vector
from estimator.physics.model import Structure
from estimator.signals.record import FloatArray

AROUND = 2
"""Samples before and behind a moment between which a law's change counts."""

LASTS = 3.0
"""Samples over which such an error is correlated: about as long as a change counts."""


class FormPlace(IntEnum):
    """Where a law whose form is in error acts: on the motor, against the load, in the shaft."""

    MOTOR = 0
    LOAD = 1
    SHAFT = 2


_MOTOR = (slots.COULOMB, slots.STRIBECK, slots.STRIBECK_COULOMB)
_LOAD = (slots.COULOMB_LOAD, slots.BRAKE)
_SHAFT = (slots.GAP, slots.STAGE)


def form_changes(result: FitResult, index: int) -> FloatArray:
    """Return by how much the laws at each place change around each sample of a recording [Nm], shape (3, N)."""
    p, record = result.p_of(index), result.problem.records[index]
    found = np.zeros((len(FormPlace), record.time_s.size))
    structure = result.problem.grid.structure
    if structure is Structure.JOINT or result.problem.grid.plant is not None:
        return found
    if p[list(_MOTOR)].any():
        found[FormPlace.MOTOR] = change_around(_at_motor(simulated(result, index, state=state_vector.SPEED), p))
    if p[list(_LOAD)].any():
        state = state_vector.SPEED if structure is Structure.ONE_MASS else state_vector.LOAD_SPEED
        found[FormPlace.LOAD] = change_around(_at_load(simulated(result, index, state=state), record.since_start_s, p))
    if p[list(_SHAFT)].any():
        found[FormPlace.SHAFT] = change_around(_in_shaft(simulated(result, index, state=state_vector.TWIST), p))
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
    found: FloatArray = p[slots.K] * (more - missing)
    return found


def change_around(law_nm: FloatArray) -> FloatArray:
    """Return the range of a torque over the samples around each one, shape (N,)."""
    padded = np.pad(law_nm, AROUND, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * AROUND + 1)
    change: FloatArray = windows.max(axis=1) - windows.min(axis=1)
    return change
