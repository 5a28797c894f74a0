"""Hypotheses fitted by least squares on the free run: a quick fit for tests of what is done with one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from estimator.diagnosis.inference.fits import unknowns_of
from estimator.diagnosis.inference.hypotheses import NOTHING, Effects
from estimator.diagnosis.inference.score_tests import Screen, promising
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, best_fit, fit, make_problem
from estimator.physics.layout import Grid
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import Problem
from estimator.physics.unknowns import Release, nominal_unknowns
from estimator.signals.record import BoolArray, Record


@dataclass(frozen=True)
class Bench:
    """A model and recordings, of which some samples count."""

    model: DrivelineModel
    records: Sequence[Record]
    use: Sequence[BoolArray]
    grid: Grid | None = None

    def fit(self, effects: Effects, warm: FitResult | None = None, releases: Sequence[Release] = ()) -> FitResult:
        """Fit a set of effects; ``warm`` is a fit that lacks one of them, placed by ``releases`` or a first look."""
        if warm is None or effects == NOTHING:
            problem = make_problem(self.model, self.records, nominal_unknowns(self.model), use=self.use, grid=self.grid)
            return fit(problem)
        had = {unknown.effect for unknown in warm.problem.shared}
        (new,) = effects - had
        if EFFECTS[new].profile:
            return best_fit([self._problem(effects, unknowns_of(warm, effects), True)], warm)
        looked = releases or [each.release for each in promising(Screen(warm, self.model).starts(new))]
        return best_fit([self._problem(effects, _joined(unknowns_of(warm, effects), each)) for each in looked], warm)

    def _problem(self, effects: Effects, release: Release, profile: bool = False) -> Problem:
        return make_problem(
            self.model, self.records, release.shared, own=release.own, profile=profile, use=self.use, grid=self.grid
        )


def _joined(common: Release, new: Release) -> Release:
    own = tuple((*old, *mine) for old, mine in zip(common.own, new.own, strict=True))
    return Release((*common.shared, *new.shared), own)
