"""The five tests, each effect judged on top of others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from estimator.diagnosis.bench import Bench
from estimator.diagnosis.evidence import VERY_STRONG, Gain, gain
from estimator.diagnosis.holdout import Examiner, HoldOut
from estimator.diagnosis.hypotheses import Effects, effects_of
from estimator.diagnosis.intervals import Z95, chance_of_coherent, reported_covariance
from estimator.diagnosis.trial import Trial, has_edge, healed_in, null_inside, ranks, scan_choices
from estimator.diagnosis.weight import VISIBLE, Weight, earns_detail
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult

SIGNIFICANT = 0.05
"""Probability of a gain by chance that this test accepts per diagnosis, all hypotheses together; four others follow."""

PART_UNSEEN = 0.25
"""Share of the relative gain on fitted samples that must show on unseen ones; an effect may act mostly elsewhere."""


@dataclass(frozen=True, slots=True)
class Jury:
    """Judges trials.

    Attributes
    ----------
    names : sequence of str
        Effects that the recordings can tell: so many hypotheses are tried.
    weight : Weight
        What counts in these recordings.
    """

    bench: Bench
    examiner: Examiner
    names: Sequence[str]
    weight: Weight

    def trial(self, name: str, effects: Effects, before: FitResult, after: FitResult) -> Trial:
        """Return the trial of an effect from the fits without and with it: three of the tests, and its law's own."""
        plain = gain(before, after)
        choices = scan_choices(name, after)
        gained = replace(plain, delta_bic=plain.delta_bic - 2.0 * choices)
        p_value = min(1.0, plain.p_value * len(self.names) * math.exp(min(choices, 600.0)))
        return Trial(name, effects, after, gained, None, p_value, self._statistics_fail(name, after, gained, p_value))

    def _statistics_fail(self, name: str, result: FitResult, gained: Gain, p_value: float) -> str | None:
        if gained.delta_bic < VERY_STRONG:
            return f"gains too little information (ΔBIC {gained.delta_bic:.0f}, needs {VERY_STRONG:.0f})"
        if p_value > SIGNIFICANT:
            return f"could be chance (p = {p_value:.2g} after {len(self.names)} hypotheses)"
        if null_inside(name, result):
            return "its interval includes the value at which it does nothing"
        if EFFECTS[name].event and not has_edge(name, result):
            return "it would act in whole recordings or not at all: no moment is seen at which it begins or ends"
        if healed := healed_in(name, result):
            return f"it would begin and end within recording {healed}, and such a change does not go back"
        values = result.values_of(name)
        entry, given = EFFECTS[name], (self.bench.model, self.bench.records, values)
        return entry.implausible(*given) or entry.unresolved(*given) or None

    def best(self, trials: Mapping[str, Trial], current: FitResult, retuned: FitResult) -> Trial | None:
        """Return the trial that gains most and passes every test, the simpler of two nested ones where they tie.

        What an effect explains that was too light to count is no evidence for another that explains less of it.
        """
        passing = [trial for trial in trials.values() if trial.failed is None]
        rank = ranks(passing, current)
        most = self._most_unresolved(trials, current)
        least_rank = -math.inf
        for trial in sorted(passing, key=lambda t: -rank[t.name]):
            if trial.result.squares > most or rank[trial.name] < least_rank:
                return None
            simpler = self._simpler(trial, trials, current)
            if not self.weight.counts(simpler.name, simpler.effects, simpler.result, current, retuned):
                least_rank = max(least_rank, rank[trial.name] - VERY_STRONG)
            elif self._beyond_rest(simpler, current) and self.holds_out(simpler, current):
                return self.examined(simpler, current)
        return None

    def _beyond_rest(self, trial: Trial, current: FitResult) -> bool:
        """Tell whether an effect beside others gains more than what they leave would give to any.

        What a chosen law leaves because it is written another way than nature's is no noise: it keeps its sign for
        long. An event finds a stretch of it to follow: its moments were sought, so that its size has to stand out.
        """
        if len(trial.effects) == 1:
            return True
        if EFFECTS[trial.name].event:
            return not null_inside(trial.name, trial.result, reported_covariance(trial.result), len(self.names))
        return chance_of_coherent(current, trial.result) * len(self.names) <= SIGNIFICANT

    def _most_unresolved(self, trials: Mapping[str, Trial], current: FitResult) -> float:
        """Return the squared error that an effect too small to tell leaves; infinity without one that beats chance."""
        return min(
            (
                trial.result.squares
                for trial in trials.values()
                if trial.gain.delta_bic >= VERY_STRONG
                and EFFECTS[trial.name].unresolved(self.bench.model, self.bench.records, trial.values)
            ),
            default=math.inf,
        )

    def _simpler(self, trial: Trial, trials: Mapping[str, Trial], current: FitResult) -> Trial:
        for name in EFFECTS[trial.name].contains:
            special = trials.get(name)
            if special is None or special.failed is not None:
                continue
            if not generalises(special.result, trial.result, current):
                return special
        return trial

    def _examine(self, trial: Trial, before: FitResult) -> HoldOut:
        return self.examiner.compare(before, effects_of(before), trial.result, trial.effects)

    def holds_out(self, trial: Trial, before: FitResult) -> bool:
        """Tell whether a fair part of the gain on the fitted samples shows on unseen ones, as far as these can tell.

        Where the unseen ones are at the noise already there is nothing to gain: an effect may not show in them.
        """
        held = self._examine(trial, before)
        seen = 1.0 - (trial.result.rms / before.rms) ** 2
        unseen = 1.0 - (held.after / held.before) ** 2
        level = self.weight.level(trial.result)
        possible = 1.0 - (level / held.before) ** 2 if held.before > VISIBLE * level else 0.0
        return unseen + Z95 * held.spread >= PART_UNSEEN * min(seen, possible)

    def examined(self, trial: Trial, before: FitResult) -> Trial:
        """Return a trial with what unseen data say."""
        return replace(trial, holdout=self._examine(trial, before))

    def final(self, name: str, chosen: Effects, current: FitResult, trial: Trial) -> Trial:
        """Judge an accepted effect once more, against the final set without it; or alone, where its fit got better."""
        if chosen == trial.effects and trial.name == name and trial.result.squares <= current.squares:
            return trial
        without = self.bench.fit(chosen - {name}, current)
        final = self.trial(name, chosen, without, current)
        return self.examined(final, without)


def generalises(special: FitResult, general: FitResult, before: FitResult) -> bool:
    """Tell whether a general law earns its place over its special case, ``before`` being the fit with neither."""
    return gain(special, general).delta_bic >= VERY_STRONG and earns_detail(special, general, before)
