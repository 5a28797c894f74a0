"""Hypotheses: sets of effects added to the nominal model; which are possible, and which exclude each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from estimator.diagnosis.black_box import acts_around
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Untestable
from estimator.physics.model import DrivelineModel, Motion
from estimator.physics.motion import turns_on
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
