"""A step told from its moment on: what changed is what comes after, where the other way round explains as much.

A payload that grows at 12 s, and one that was smaller until 12 s beside a larger nominal inertia, are one and the same
motion. A fit ends in either; people expect the first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Step
from estimator.physics.fit import FitResult, fit
from estimator.physics.model import DrivelineModel
from estimator.physics.unknowns import LocalBasis
from estimator.signals.record import FloatArray, Record

EDGE_S = 0.5
"""An event's moment nearer to a recording's end is none: any start-up error looks like one."""

SAME = 1.001
"""Squared error told the other way round, over the one before, up to which it is the same explanation."""

Moments = tuple[float, float]


def from_their_moment(result: FitResult, model: DrivelineModel) -> FitResult:
    """Return a fit in which steps that end inside recordings begin there instead, where nominal values allow it."""
    for name, entry in EFFECTS.items():
        if entry.step is not None and any(shared.effect == name for shared in result.problem.shared):
            result = _turned(result, model, name, entry.step)
    return result


def moments_of(result: FitResult, name: str) -> list[Moments]:
    """Return from when to when an event acts in each recording [s since its start]; empty ones where it does not."""
    found = []
    for i, basis in enumerate(result.problem.local):
        values = zip(basis.own, result.local_of(i)[basis.own_rows], strict=True)
        own = {unknown.name: float(value) for unknown, value in values if unknown.effect == name}
        found.append((own["from_s"], own["to_s"]))
    return found


def inside(record: Record, moment_s: float) -> bool:
    """Tell whether a moment is inside a recording, away from its ends."""
    first, last = (float(end) for end in record.since_start_s[[0, -1]])
    return first + EDGE_S <= moment_s <= last - EDGE_S


def _turned(result: FitResult, model: DrivelineModel, name: str, step: Step) -> FitResult:
    found = list(zip(result.problem.records, moments_of(result, name), strict=True))
    begins = sum(to_s > from_s and inside(record, from_s) for record, (from_s, to_s) in found)
    ends = sum(to_s > from_s and inside(record, to_s) for record, (from_s, to_s) in found)
    both = any(inside(record, from_s) and inside(record, to_s) for record, (from_s, to_s) in found)
    if both or begins >= ends:
        return result
    shared = {(s.effect, s.name): row for row, s in enumerate(result.problem.shared)}
    nominal, size = shared["", step.of(model)], next(row for (effect, _), row in shared.items() if effect == name)
    after, back = step.turned(*(float(result.x[row]) * result.problem.shared[row].scale for row in (nominal, size)))
    x = result.x[: len(shared)].copy()
    for row, value in ((nominal, after), (size, back)):
        unknown = result.problem.shared[row]
        x[row] = value / unknown.scale
        if not unknown.low <= x[row] <= unknown.high:
            return result
    turned = [
        _complement(result.problem.local[i], result.local_of(i), name, record, moments)
        for i, (record, moments) in enumerate(found)
    ]
    problem = replace(result.problem, local=tuple(basis for basis, _ in turned))
    again = fit(problem, np.concatenate([x, *(local for _, local in turned)]))
    return again if again.squares <= SAME * result.squares else result


def _complement(
    basis: LocalBasis, local: FloatArray, name: str, record: Record, moments: Moments
) -> tuple[LocalBasis, FloatArray]:
    """Return a recording's basis and unknowns with an event where it did not act before."""
    first, last = (float(end) for end in record.since_start_s[[0, -1]])
    from_s, to_s = moments
    if to_s <= from_s:
        times = {"from_s": first, "to_s": last}
    elif inside(record, to_s):
        times = {"from_s": to_s, "to_s": last}
    elif inside(record, from_s):
        times = {"from_s": first, "to_s": from_s}
    else:
        times = {"from_s": first, "to_s": first}
    own, local = [], local.copy()
    for row, unknown in enumerate(basis.own, start=basis.own_rows.start):
        if unknown.effect == name:
            at = local[row] = times[unknown.name]
            near = EDGE_S if inside(record, at) else 0.0
            unknown = replace(unknown, start=at, low=at - near, high=at + near)
        own.append(unknown)
    return replace(basis, own=tuple(own)), local
