"""Hypotheses: the nominal model with a set of effects released, fitted and remembered."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Untestable
from estimator.physics.fit import FitResult, best_fit, make_problem
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import grid_for
from estimator.physics.unknowns import Shared, effect_unknowns, nominal_unknowns
from estimator.signals.record import BoolArray, Record

Effects = frozenset[str]
NOTHING: Effects = frozenset()

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of the work behind it; raise from it to cancel."""


def with_effect(effects: Effects, name: str) -> Effects:
    """Add an effect to a set; it replaces the special cases of itself."""
    return (effects - set(EFFECTS[name].contains)) | {name}


@dataclass
class Bench:
    """A model and recordings on which hypotheses are fitted, each set of effects once.

    Attributes
    ----------
    use : sequence of ndarray of bool
        Which samples count in each recording.
    """

    model: DrivelineModel
    records: Sequence[Record]
    use: Sequence[BoolArray]
    _fits: dict[Effects, FitResult] = field(default_factory=dict)

    def fit(self, effects: Effects, warm: FitResult | None = None) -> FitResult:
        """Fit the nominal parameters, within their tolerances, together with a set of effects.

        Parameters
        ----------
        warm : FitResult, optional
            A fit whose values the common unknowns start from; effects that it lacks start at each of their own
            start points, and the best result counts.
        """
        if effects not in self._fits:
            self._fits[effects] = self._fit(effects, warm)
        return self._fits[effects]

    def _fit(self, effects: Effects, warm: FitResult | None) -> FitResult:
        known = set() if warm is None else {shared.effect for shared in warm.problem.shared}
        starts: list[tuple[Shared, ...]] = [nominal_unknowns(self.model)]
        for name in sorted(effects):
            choices = effect_unknowns(name, self.model, self.records)
            if name in known:
                choices = choices[:1]
            starts = [start + choice for start in starts for choice in choices]
        grid = grid_for(self.model, self.records)
        profile = any(EFFECTS[name].profile for name in effects)
        problems = [
            make_problem(self.model, self.records, shared, profile=profile, use=self.use, grid=grid)
            for shared in starts
        ]
        return best_fit(problems, warm)


def open_hypotheses(model: DrivelineModel, records: Sequence[Record]) -> tuple[tuple[str, ...], dict[str, Untestable]]:
    """Sort the catalogue into effects that the recordings can tell and those they can't, with the reason.

    Effects that make no sense in the model's structure, or that the model already has, are in neither.
    """
    testable, untestable = [], {}
    for name, entry in EFFECTS.items():
        if model.structure not in entry.structures or name in model.effects:
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
