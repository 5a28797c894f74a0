"""Which effects are worth a fit, and from where: a score test of each, under the hypothesis' own weighting."""

from __future__ import annotations

from estimator.diagnosis.inference.disturbances import Whitener
from estimator.diagnosis.inference.likelihood import Hypothesis
from estimator.diagnosis.screening import Look, Screen
from estimator.physics.model import DrivelineModel
from estimator.physics.projector import Projector
from estimator.signals.record import FloatArray


class _Weighted(Projector):
    """Takes signals as the simulation gives them, and weighs them as a hypothesis does."""

    def __init__(self, hypothesis: Hypothesis) -> None:
        super().__init__(hypothesis.white)
        self._filter: Whitener = hypothesis.filter
        self._firsts: list[int] = [0]
        for use in hypothesis.plain.problem.use:
            self._firsts.append(self._firsts[-1] + int(use.sum()))

    def products(self, answers: FloatArray, rows: slice) -> tuple[FloatArray, FloatArray]:
        return super().products(self._filter.part(self._firsts.index(rows.start), answers.T).T, rows)

    def promise(self, direction: FloatArray, low: float, high: float) -> tuple[float, float]:
        return super().promise(self._filter(direction), low, high)


def screen(hypothesis: Hypothesis, model: DrivelineModel) -> Screen:
    """Return a first look at effects around a hypothesis; promises are falls of the squared innovations."""
    return Screen(hypothesis.white, model, _Weighted(hypothesis))


__all__ = ["Look", "screen"]
