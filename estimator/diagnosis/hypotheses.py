"""Hypotheses: sets of effects added to the nominal model, and where a fit of one begins that continues another."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.black_box import acts_around
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Untestable
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel, Motion
from estimator.physics.motion import turns_on
from estimator.physics.unknowns import Release, Shared
from estimator.signals.record import BoolArray, Record

Effects = frozenset[str]
NOTHING: Effects = frozenset()


Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the work behind it; raise from it to cancel."""


def silent(_message: str, _share: float) -> None:
    """Report nothing."""


def with_effect(effects: Effects, name: str) -> Effects:
    """Add an effect to a set; it replaces the special cases of itself."""
    return (effects - set(EFFECTS[name].contains)) | {name}


def open_hypotheses(model: DrivelineModel, records: Sequence[Record]) -> tuple[tuple[str, ...], dict[str, Untestable]]:
    """Sort the catalogue into effects that the recordings can tell and those they can't, with the reason.

    Effects that make no sense in the model's structure or for such a motion, that act inside a plant simulated
    elsewhere, or that the model already has, are in neither.
    """
    testable, untestable = [], {}
    for name in (*EFFECTS, *model.laws):
        entry = EFFECTS[name]
        fits = model.structure in entry.structures and all(record.kind in entry.kinds for record in records)
        turns = model.motion is Motion.ROTATION or not entry.phases
        swings = not (entry.swinging and turns_on(records))
        reached = model.plant is None or acts_around(entry)
        if not (fits and turns and swings and reached) or name in model.effects or entry.recognised:
            continue
        obstacle = entry.testable(model, records)
        if obstacle is None:
            testable.append(name)
        else:
            untestable[name] = obstacle
    return tuple(testable), untestable


def everything(records: Sequence[Record]) -> list[BoolArray]:
    """Return masks that use every good sample."""
    return [np.asarray(record.okay) for record in records]


def kept(warm: FitResult, effects: Collection[str]) -> Release:
    """Return the unknowns of a fit that belong to the line itself or to some effects."""
    wanted = {"", *effects}
    return Release(
        tuple(unknown for unknown in warm.problem.shared if unknown.effect in wanted),
        tuple(tuple(unknown for unknown in basis.own if unknown.effect in wanted) for basis in warm.problem.local),
    )


def inheriting(name: str, release: Release, warm: FitResult) -> Release:
    """Return a start of a general law that keeps what a fit of its special case has found out by another telling.

    Friction that was seen to bend before it slides does so with a Stribeck range, too: begun without, such a fit is far
    behind the special case and would be given up.
    """
    found = {
        key: value for special in EFFECTS[name].contains for key, value in warm.values_of(special).items() if value
    }
    limits = {parameter.name: (parameter.low, parameter.high) for parameter in EFFECTS[name].parameters}

    def inherited(unknown: Shared) -> Shared:
        if unknown.low < unknown.high or unknown.name not in found:
            return unknown
        low, high = limits[unknown.name]
        return replace(unknown, low=low, high=high, start=min(max(found[unknown.name] / unknown.scale, low), high))

    return replace(release, shared=tuple(inherited(unknown) for unknown in release.shared))


def forgetting(result: FitResult, name: str) -> FitResult:
    """Return a fit as if the parameters of an effect that all recordings share had not been released in it."""
    keep = [shared.effect != name for shared in result.problem.shared]
    shared = tuple(each for each, kept in zip(result.problem.shared, keep, strict=True) if kept)
    left = [*keep, *[True] * (result.x.size - len(keep))]
    problem = replace(result.problem, shared=shared)
    return replace(result, problem=problem, x=result.x[left], derivative=None)  # which was found with the effect


def line_values(result: FitResult) -> dict[str, float]:
    """Return the values of the line's own parameters in a fit, those that it may not change among them."""
    return {name: float(result.p[slot("", name)]) for name in result.problem.grid.structure.parameter_names}


def placed(result: FitResult, line: Mapping[str, float]) -> FitResult:
    """Return a fit with some of the line's own parameters elsewhere, within what they are trusted to."""
    x = result.x.copy()
    for i, shared in enumerate(result.problem.shared):
        if not shared.effect and shared.name in line:
            x[i] = min(max(line[shared.name] / shared.scale, shared.low), shared.high)
    return replace(result, x=x)
