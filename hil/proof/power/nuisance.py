"""What a test has to estimate along: the outputs' sensitivities to bus, load torque and initial state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from hil.proof.power.drive import Drive, drive
from hil.proof.truth.case import TESTS
from hil.proof.truth.physics import FloatArray, Physics
from hil.proof.truth.specimen import draw_specimen
from hil.proof.truth.state import State

PARAMETERS = ("J_M", "J_L", "k", "c", "b_M", "b_L")
"""Nuisance parameters that all recordings share."""

STEP = 1e-3
"""Step of the finite differences, over the parameter's value."""

START_STEPS = ((State.SPEED_M, 1e-2), (State.SPEED_L, 1e-2), (State.ANGLE_M, 1e-4))
"""Initial state: speeds [rad/s] and twist [rad], and the steps of their differences; the line is linear in them."""

LOAD_STEP_NM = 0.1

COLLINEAR = 1e-8
"""Singular value, over the largest, below which a combination of nuisance parameters moves nothing."""

BUSES_KEPT = 8
"""All effects of one seed share a bus."""


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
    specimen = draw_specimen("none", seed)
    return _columns([drive(specimen, test, samples) for test in range(len(TESTS))])


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


def _columns(drives: Sequence[Drive]) -> FloatArray:
    ends = np.cumsum([0, *(each.m1_nm.size for each in drives)])
    shared = [np.concatenate([_by_parameter(each, name) for each in drives]) for name in PARAMETERS]
    own = []
    for each, first, last in zip(drives, ends[:-1], ends[1:], strict=True):
        for moved in (_by_load(each), *(_by_start(each, place, step) for place, step in START_STEPS)):
            column = np.zeros(ends[-1])
            column[first:last] = moved
            own.append(column)
    return np.column_stack([*shared, *own])


def _by_parameter(each: Drive, name: str) -> FloatArray:
    value = getattr(each.physics, name)
    return _across(each, lambda sign: each.physics._replace(**{name: value * (1.0 + sign * STEP)}))


def _by_load(each: Drive) -> FloatArray:
    value = each.physics.load_torque_nm
    return _across(each, lambda sign: each.physics._replace(load_torque_nm=value + sign * LOAD_STEP_NM))


def _across(each: Drive, physics: Callable[[float], Physics]) -> FloatArray:
    up, down = (Drive(physics(sign), each.state, each.m1_nm, each.m2_nm) for sign in (1.0, -1.0))
    return up.speed_rad_s() - down.speed_rad_s()


def _by_start(each: Drive, place: State, step: float) -> FloatArray:
    moved = []
    for sign in (1.0, -1.0):
        state = each.state.copy()
        state[place] += sign * step
        moved.append(Drive(each.physics, state, each.m1_nm, each.m2_nm).speed_rad_s())
    return moved[0] - moved[1]
