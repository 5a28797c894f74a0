"""What a test has to estimate along: the outputs' sensitivities to bus, load torque and initial state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hil.proof.mismatch.line import PARAMETERS, line_of, scaled
from hil.proof.power.drive import drive
from hil.proof.truth.bus import Bus
from hil.proof.truth.case import TESTS
from hil.proof.truth.physics import FloatArray
from hil.proof.truth.specimen import draw_specimen
from hil.proof.truth.state import State

STEP = 1e-3
"""Step of the finite differences, over the parameter's value."""

COLLINEAR = 1e-8
"""Singular value, over the largest, below which a combination of nuisance parameters moves nothing."""

BUSES_KEPT = 8
"""All effects of one seed share a bus."""


@dataclass(frozen=True, slots=True)
class _Run:
    """A test of a bus with nothing hidden: torque of both inverters [Nm], shape (N,), and initial state, shape (3,)."""

    torque_nm: FloatArray
    start: FloatArray


@lru_cache(maxsize=BUSES_KEPT)
def sensitivities(seed: int, samples: int) -> FloatArray:
    """Return what each nuisance parameter of a seed's bus moves the outputs by, shape (3 N, 18), in no unit.

    Nothing is hidden in the bus. Six parameters are shared, four are each recording's own: the load torque, two speeds
    and the twist at its beginning. None is held to the nominal model's tolerance.

    Parameters
    ----------
    seed
        What the bus was drawn from.
    samples
        Length N of each recording.
    """
    bus = draw_specimen("none", seed).bus
    return _columns(bus, [_run(seed, test, samples) for test in range(len(TESTS))])


def without(basis: FloatArray, moved: FloatArray) -> FloatArray:
    """Return what of an output's change, shape (M,), is outside the span of a basis, shape (M, K)."""
    rest: FloatArray = moved - basis @ (basis.T @ moved)
    return rest


def orthonormal(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the columns' span, shape (M, rank); columns of zeros are left out."""
    norms = np.linalg.norm(columns, axis=0)
    basis, values, _ = np.linalg.svd(columns[:, norms > 0.0] / norms[norms > 0.0], full_matrices=False)
    spanning: FloatArray = basis[:, values > COLLINEAR * values[0]]
    return spanning


def _run(seed: int, test: int, samples: int) -> _Run:
    still = drive(draw_specimen("none", seed), test, samples)
    twist = still.state[State.ANGLE_M] - still.state[State.ANGLE_L]
    start = np.array([twist, still.state[State.SPEED_M], still.state[State.SPEED_L]])
    return _Run(still.m1_nm + still.m2_nm, start)


def _columns(bus: Bus, runs: Sequence[_Run]) -> FloatArray:
    ends = np.cumsum([0, *(run.torque_nm.size for run in runs)])
    shared = [_by_parameter(bus, name, runs) for name in PARAMETERS]
    own = []
    for run, first, last in zip(runs, ends[:-1], ends[1:], strict=True):
        for moved in line_of(bus).of_load_and_start(run.torque_nm.size):
            column = np.zeros(ends[-1])
            column[first:last] = moved
            own.append(column)
    return np.column_stack([*shared, *own])


def _by_parameter(bus: Bus, name: str, runs: Sequence[_Run]) -> FloatArray:
    up, down = (line_of(scaled(bus, {name: 1.0 + sign * STEP})) for sign in (1.0, -1.0))
    load_nm = bus.load_torque_nm
    return np.concatenate(
        [
            up.speed_rad_s(run.torque_nm, load_nm, run.start) - down.speed_rad_s(run.torque_nm, load_nm, run.start)
            for run in runs
        ]
    )
