"""A step expressed from its moment on: what changed is what comes after, where the other way round explains as much.

A payload that grows at 12 s, and one that was smaller until 12 s next to a larger nominal inertia, are one and the same
motion. A fit ends in either; people expect the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Step
from estimator.physics.fit import FitResult, fit
from estimator.physics.model import DrivelineModel
from estimator.physics.unknowns import LocalBasis
from estimator.signals.record import FloatArray, Record

EDGE_S = 0.5
"""An event's moment nearer to a recording's end is none: any start-up error looks like one. Nor is an event that is
over sooner: with a single sample of it, two vehicles would be one that changed."""

EQUIVALENT_RATIO = 1.001
"""Squared error expressed the other way round, over the one before, up to which it is the same explanation."""

Moments = tuple[float, float]

PART_SEEN = 0.1
"""Share of the time in which an event acts that must be in recordings where it begins or ends. A brake all through one
recording is dry friction, which others that do not reverse hide; half a second of it in one of them is chance."""


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
    """Tell whether a moment [s] is far enough from both ends of a recording to be an event in it."""
    first, last = (float(end) for end in record.since_start_s[[0, -1]])
    return first + EDGE_S <= moment_s <= last - EDGE_S


def _comes_and_goes(record: Record, moments: Moments) -> bool:
    return all(inside(record, moment_s) for moment_s in moments)


def _turned(result: FitResult, model: DrivelineModel, name: str, step: Step) -> FitResult:
    found = list(zip(result.problem.records, moments_of(result, name), strict=True))
    once = [(record, times) for record, times in found if times[1] > times[0] and not _comes_and_goes(record, times)]
    begins, ends = (sum(inside(record, times[which]) for record, times in once) for which in (0, 1))
    if begins >= ends:
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
    came_and_went = any(_comes_and_goes(record, moments) for record, moments in found)
    tries = [
        _expressed(result, name, found, x, from_the_start)
        for from_the_start in ((False, True) if came_and_went else (False,))
    ]
    best = min(tries, key=lambda expressed: expressed.squares)
    return best if best.squares <= EQUIVALENT_RATIO * result.squares else result


def _expressed(
    result: FitResult, name: str, found: Sequence[tuple[Record, Moments]], x: FloatArray, from_the_start: bool
) -> FitResult:
    """Fit from an event where it did not act before, and from the shared unknowns ``x`` for it."""
    turned = [
        _complement(result.problem.local[i], result.local_of(i), name, record, moments, from_the_start)
        for i, (record, moments) in enumerate(found)
    ]
    leads = result.problem.leads
    problem = replace(result.problem, local=tuple(turned[lead][0] for lead in leads))
    return fit(problem, np.concatenate([x, *(turned[i][1] for i in sorted(set(leads)))]))


def _complement(
    basis: LocalBasis, local: FloatArray, name: str, record: Record, moments: Moments, from_the_start: bool
) -> tuple[LocalBasis, FloatArray]:
    """Return a recording's basis and unknowns with an event where it did not act before.

    One that comes and goes leaves no single stretch. It is taken for badly sought: acting from where it ended, or from
    the start on as if there were none, with a beginning that may move.
    """
    first, last = (float(end) for end in record.since_start_s[[0, -1]])
    from_s, to_s = moments
    sought = _comes_and_goes(record, moments)
    if to_s <= from_s or (sought and from_the_start):
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
            if sought and unknown.name == "from_s":
                unknown = replace(unknown, low=first, high=last)
        own.append(unknown)
    return replace(basis, own=tuple(own)), local


def has_edge(name: str, result: FitResult) -> bool:
    """Tell whether an event begins or ends inside a recording, and acts there for longer than a glimpse.

    Where it would be another effect if it acted all along, that must be more next to whole recordings.
    """
    acting = [
        (to_s - from_s, inside(record, from_s) or inside(record, to_s))
        for record, (from_s, to_s) in zip(result.problem.records, moments_of(result, name), strict=True)
        if to_s > from_s
    ]
    seen_s = sum(length_s for length_s, edged in acting if edged)
    least = PART_SEEN if EFFECTS[name].permanent else 0.0
    return seen_s > max(EDGE_S, least * sum(length_s for length_s, _ in acting))
