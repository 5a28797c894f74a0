"""Score tests around a hypothesis, with what was simulated around others of the same motion.

To which answer an output comes when a law is added depends on the motion, and hardly on how the errors are weighed. So
what one hypothesis has simulated will do for the next, and only the weighing is its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from estimator.diagnosis.inference.disturbances import Whitener
from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.inference.score_tests import Screen
from estimator.diagnosis.thresholds import Searching
from estimator.physics.fit import FitResult
from estimator.physics.model import DrivelineModel
from estimator.physics.own_scan import Projector, Simulate
from estimator.signals.record import FloatArray

ROOM_BYTES = 2**27  # room that answers may take


@dataclass
class OutputChanges:
    """Changes of the output, by what was changed, around some motions."""

    # A fit, and for each recording changes by digest of what was changed.
    around: list[tuple[FitResult, list[dict[bytes, FloatArray]]]] = field(default_factory=list)

    def near(self, fit: FitResult) -> list[dict[bytes, FloatArray]]:
        """Return what is known around a motion that is nearly a fit's, by recording; empty where there is none."""
        for other, known in self.around:
            if _difference(fit, other) < Searching.SAME_MOTION:
                return known
        return [{} for _ in fit.problem.drives]

    def learn(self, fit: FitResult, found: Sequence[dict[bytes, FloatArray]]) -> None:
        """Keep what was found around a fit; called in a fixed order: results depend on no number of cores."""
        if self.is_full() or not any(found):
            return
        known = self.near(fit)
        if not any(known is each for _, each in self.around):
            self.around.append((fit, known))
        for old, new in zip(known, found, strict=True):
            old.update(new)

    def is_full(self) -> bool:
        """Tell whether the answers take all the room there is for them."""
        each = (known for _, all_known in self.around for known in all_known)
        return sum(len(known) * next(iter(known.values())).nbytes for known in each if known) > ROOM_BYTES


def _difference(fit: FitResult, other: FitResult) -> float:
    pairs = zip(fit.outputs, other.outputs, strict=True)
    squares = sum(float(np.sum((mine - its) ** 2)) for mine, its in pairs)
    return float(np.sqrt(squares / sum(float(np.sum((out - out.mean()) ** 2)) for out in fit.outputs)))


class _Weighted(Projector):
    """Takes signals as the simulation gives them, and weighs them as a hypothesis does."""

    def __init__(self, hypothesis: Hypothesis) -> None:
        super().__init__(hypothesis.white)
        self._filter: Whitener = hypothesis.filter

    def products(self, answers: FloatArray, index: int) -> tuple[FloatArray, FloatArray]:
        return super().products(self._filter.part(index, answers.T).T, index)

    def promise(self, direction: FloatArray, low: float, high: float) -> tuple[float, float]:
        white = self._filter(direction)
        return super().promise(white, low, high) if np.isfinite(white @ white) else (0.0, 0.0)


class WeightedScoreTests(Screen):
    """Looks at effects around a hypothesis with answers found around others where these will do."""

    def __init__(self, hypothesis: Hypothesis, model: DrivelineModel, answers: OutputChanges) -> None:
        super().__init__(hypothesis.white, model, _Weighted(hypothesis))
        self._known = answers.near(hypothesis.result)
        self.found: list[dict[bytes, FloatArray]] = [{} for _ in self._known]

    def _runner(self, index: int) -> Simulate:
        simulate, known, found_here = super()._runner(index), self._known[index], self.found[index]
        nominal, still = self._result.p_of(index), self._output(index)

        def run(parameters: Sequence[FloatArray], alike_s: FloatArray | None = None) -> FloatArray:
            keys = [_changed(nominal, p) for p in parameters]
            if all(key in known for key in keys):
                return np.array([still + known[key] for key in keys])
            found = simulate(parameters, alike_s)
            found_here.update((key, (out - still).astype(np.float32)) for key, out in zip(keys, found, strict=True))
            return found

        return run


def _changed(nominal: FloatArray, p: FloatArray) -> bytes:
    places = np.flatnonzero(p != nominal)
    return places.tobytes() + p[places].tobytes()
