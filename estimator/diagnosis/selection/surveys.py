"""Laws without a name in what fits leave, each fit searched once."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from estimator.diagnosis.hypotheses import effects_of
from estimator.diagnosis.selection.outcome import Survey, located, survey
from estimator.diagnosis.unnamed import UnnamedLaw
from estimator.diagnosis.weight import NEAR_NOISE, SEEN, Weight
from estimator.physics.fit import FitResult


@dataclass
class Surveys:
    """First looks at what fits leave, and the search to the end in what the re-tuned nominal leaves."""

    weight: Weight
    _first: dict[int, tuple[FitResult, Survey]] = field(default_factory=dict)
    _located: Survey | None = None

    def of(self, result: FitResult) -> Survey:
        """Look for laws without a name in what a fit leaves.

        Only what the re-tuned nominal leaves is looked at again: of other fits the hunts are let go.
        """
        known = self._first.get(id(result))
        if known is None:
            found = survey(result)
            kept = found if not effects_of(result) else replace(found, hunts=())
            known = self._first[id(result)] = (result, kept)
        return known[1]

    def law(self, result: FitResult) -> UnnamedLaw | None:
        """Return the law without a name that counts for what a fit leaves."""
        return self.of(result).law

    def whole(self, retuned: FitResult) -> Survey:
        """Search to the end for one law that explains all that the re-tuned nominal leaves; once."""
        if self._located is None:
            self._located = located(retuned, self.of(retuned))
        return self._located

    def furthest(self, retuned: FitResult) -> Survey:
        """Return the search in what the re-tuned nominal leaves, as far as it went."""
        return self.of(retuned) if self._located is None else self._located

    def is_one_law(self, retuned: FitResult, result: FitResult) -> bool:
        """Tell whether one law without a name explains all that the re-tuned nominal leaves, to the noise of a fit."""
        law = self.whole(retuned).law
        return law is not None and law.rms <= SEEN * self.weight.level(result)

    def may_be_one_law(self, retuned: FitResult, result: FitResult) -> bool:
        """Tell whether a first look, which is quick, brings one near the noise, and nearer than a fit with effects."""
        law = self.law(retuned)
        return law is not None and law.rms <= min(NEAR_NOISE * self.weight.level(result), result.rms)
