"""Which effects are missing: forward addition and backward removal, each step judged by five tests.

An effect earns its place when

1. information: the BIC gains more than ``VERY_STRONG`` (residual correlation taken into account);
2. chance: its p-value, times the number of hypotheses tried (Bonferroni), is below ``SIGNIFICANT``;
3. null: the 95 % interval of its decisive parameter excludes the value at which it does nothing;
4. unseen data: the error on held-out samples falls;
5. weight: it removes a part of the mismatch that is more than the difference between two ways to write one law.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.evidence import VERY_STRONG, Gain, gain, residuals_by_record
from estimator.diagnosis.holdout import Examiner, HoldOut
from estimator.diagnosis.hypotheses import NOTHING, Bench, Effects, Progress, with_effect
from estimator.diagnosis.intervals import covariance, interval
from estimator.diagnosis.noise import unpredictable
from estimator.diagnosis.unnamed import UnnamedLaw, best_unnamed
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult

SIGNIFICANT = 0.01
"""Probability of a false claim that is accepted per diagnosis, all hypotheses together."""

MOST_EFFECTS = 4

PART_OF_MISMATCH = 0.05
"""Share of the first mismatch's power that a further effect must remove, or else
``VISIBLE`` of the RMS and half of what stands."""

PART_FOR_DETAIL = 0.01
"""Share of what a special case removes that its generalisation must remove on top: the same friction written as
bristles or as a rounded sign differs by less."""

PART_UNSEEN = 0.25
"""Share of the relative gain on fitted samples that must show on unseen ones; an effect may act mostly elsewhere."""

VISIBLE = 1.05


@dataclass(frozen=True, slots=True)
class Trial:
    """One effect tried on top of others, with what speaks for it and the first test it failed."""

    name: str
    effects: Effects
    result: FitResult
    gain: Gain
    holdout: HoldOut | None
    p_value: float
    failed: str | None


@dataclass(frozen=True, slots=True)
class Selection:
    """The outcome: the effects chosen, their fit, each one's last trial, and the first trial of every effect."""

    retuned: FitResult
    chosen: Effects
    result: FitResult
    accepted: Mapping[str, Trial]
    trials: Mapping[str, Trial]


@dataclass
class Selector:
    """Runs the selection on one bench.

    Attributes
    ----------
    floor : float
        Noise floor of the output.
    names : sequence of str
        Effects that the recordings can tell.
    """

    bench: Bench
    examiner: Examiner
    names: Sequence[str]
    floor: float
    progress: Progress
    _rounds: int = 0

    def run(self) -> Selection:
        """Add effects while one earns its place; then drop those that the others made superfluous.

        A further round of fits is only made where some law, named or not, still has something to explain.
        """
        retuned = self.bench.fit(NOTHING)
        chosen, current = NOTHING, retuned
        first_trials: dict[str, Trial] = {}
        accepted: dict[str, Trial] = {}
        for _ in range(MOST_EFFECTS):
            trials = self._try_all(chosen, current)
            for name, trial in trials.items():
                first_trials.setdefault(name, trial)
            best = self._best(trials, current, retuned)
            if best is None and not chosen:
                best = self._behind_profile(retuned)
            if best is None:
                break
            accepted = {name: accepted.get(name, best) for name in best.effects} | {best.name: best}
            chosen, current = best.effects, best.result
            if counting_law(current) is None:
                break
        chosen, current = self._drop_superfluous(chosen, current, retuned)
        accepted = {
            name: self._final(name, chosen, current, trial) for name, trial in accepted.items() if name in chosen
        }
        return Selection(retuned, chosen, current, accepted, first_trials)

    def _behind_profile(self, retuned: FitResult) -> Trial | None:
        """Look for an effect behind a slow load that by itself hides it, where something stands but nothing passed.

        A slow disturbance moves the free run by many times what a fast effect does; and alone it must pay for all its
        knots out of an error that the fast effect keeps correlated. Both are judged again in the final set.
        """
        profiles = [name for name in self.names if EFFECTS[name].profile]
        if not profiles or counting_law(retuned) is None:
            return None
        slow = frozenset(profiles[:1])
        behind = self.bench.fit(slow, retuned)
        if behind.rms**2 > 0.5 * retuned.rms**2:  # nothing slow dominates: there is nothing to look behind
            return None
        return self._best(self._try_all(slow, behind), behind, retuned)

    def _try_all(self, chosen: Effects, current: FitResult) -> dict[str, Trial]:
        trials = {}
        superseded = {name for have in chosen for name in EFFECTS[have].contains}
        candidates = [name for name in self.names if name not in chosen and name not in superseded]
        for i, name in enumerate(candidates):
            share = 0.9 * (1.0 - 0.5**self._rounds * (1.0 - 0.5 * i / len(candidates)))  # a round is half of the rest
            self.progress(f"testing {EFFECTS[name].title}", share)
            effects = with_effect(chosen, name)
            result = self.bench.fit(effects, current)
            trials[name] = self._trial(name, effects, current, result)
        self._rounds += 1
        return trials

    def _trial(self, name: str, effects: Effects, before: FitResult, after: FitResult) -> Trial:
        gained = gain(before, after)
        p_value = min(1.0, gained.p_value * len(self.names))
        return Trial(name, effects, after, gained, None, p_value, self._statistics_fail(name, after, gained, p_value))

    def _statistics_fail(self, name: str, result: FitResult, gained: Gain, p_value: float) -> str | None:
        if gained.delta_bic < VERY_STRONG:
            return f"gains too little information (ΔBIC {gained.delta_bic:.0f}, needs {VERY_STRONG:.0f})"
        if p_value > SIGNIFICANT:
            return f"could be chance (p = {p_value:.2g} after {len(self.names)} hypotheses)"
        if null_inside(name, result):
            return "its interval includes the value at which it does nothing"
        return None

    def _best(self, trials: Mapping[str, Trial], current: FitResult, retuned: FitResult) -> Trial | None:
        """Return the trial that gains most and passes every test, the simpler of two nested ones where they tie."""
        passing = [trial for trial in trials.values() if trial.failed is None]
        for trial in sorted(passing, key=lambda t: -t.gain.delta_bic):
            simpler = self._simpler(trial, trials, current)
            if self._weighty(simpler.name, simpler.effects, simpler.result, current, retuned) and self._holds_out(
                simpler, current
            ):
                return self._examined(simpler, current)
        return None

    def _simpler(self, trial: Trial, trials: Mapping[str, Trial], current: FitResult) -> Trial:
        for name in EFFECTS[trial.name].contains:
            special = trials.get(name)
            if special is not None and special.failed is None:
                more = gain(special.result, trial.result)
                if more.delta_bic < VERY_STRONG or not self._earns_detail(special, trial, current):
                    return special
        return trial

    @staticmethod
    def _earns_detail(special: Trial, general: Trial, current: FitResult) -> bool:
        """Tell whether the general law removes clearly more of the mismatch than its special case."""
        removed = special.result.rms**2 - general.result.rms**2
        return removed >= PART_FOR_DETAIL * (current.rms**2 - special.result.rms**2)

    def _visible(self, before: FitResult, after: FitResult) -> bool:
        floor = min(self.floor, unpredictable(residuals_by_record(before)))
        standing = max(before.rms**2 - floor**2, 0.0)
        removed = before.rms**2 - after.rms**2
        return before.rms >= VISIBLE * after.rms and removed >= 0.5 * standing

    def _weighty(self, name: str, effects: Effects, after: FitResult, before: FitResult, retuned: FitResult) -> bool:
        """Tell whether an effect removes enough to count.

        At an element of its own it may be small, if it can be seen. Beside another effect of the same element it must
        be a real part of the mismatch: a law written another way leaves just such a small remainder. So must a profile,
        which can take up any slow rest.
        """
        mismatch = max(retuned.rms**2 - self.floor**2, retuned.rms**2 - after.rms**2)
        removed = before.rms**2 - after.rms**2
        if removed >= PART_OF_MISMATCH * mismatch:
            return True
        neighbours = {EFFECTS[other].element for other in effects if other != name}
        alike = EFFECTS[name].element in neighbours or EFFECTS[name].profile
        return not alike and self._visible(before, after)

    def _examine(self, trial: Trial, before: FitResult) -> HoldOut:
        smaller = frozenset(shared.effect for shared in before.problem.shared if shared.effect)
        if any(basis.profile.size for basis in before.problem.local):
            smaller |= {name for name in trial.effects if EFFECTS[name].profile and name != trial.name}
        return self.examiner.compare(before, smaller, trial.result, trial.effects)

    def _holds_out(self, trial: Trial, before: FitResult) -> bool:
        """Tell whether a fair part of the gain on the fitted samples shows on unseen ones."""
        held = self._examine(trial, before)
        seen = 1.0 - (trial.result.rms / before.rms) ** 2
        unseen = 1.0 - (held.after / held.before) ** 2
        return unseen >= PART_UNSEEN * seen

    def _examined(self, trial: Trial, before: FitResult) -> Trial:
        return Trial(
            trial.name,
            trial.effects,
            trial.result,
            trial.gain,
            self._examine(trial, before),
            trial.p_value,
            None,
        )

    def _drop_superfluous(self, chosen: Effects, current: FitResult, retuned: FitResult) -> tuple[Effects, FitResult]:
        for name in sorted(chosen) if len(chosen) > 1 else ():
            without = self.bench.fit(chosen - {name}, current)
            gained = gain(without, current)
            if gained.delta_bic < VERY_STRONG or not self._weighty(name, chosen, current, without, retuned):
                return self._drop_superfluous(chosen - {name}, without, retuned)
        return chosen, current

    def _final(self, name: str, chosen: Effects, current: FitResult, trial: Trial) -> Trial:
        """Judge an accepted effect once more, against the final set without it."""
        if chosen == trial.effects and trial.name == name:
            return trial
        without = self.bench.fit(chosen - {name}, current)
        final = self._trial(name, chosen, without, current)
        return self._examined(final, without)


def counting_law(result: FitResult) -> UnnamedLaw | None:
    """Return the law without a name that best explains what a fit leaves, if it is beyond chance and visible."""
    law = best_unnamed(result)
    if law is None or law.gain.delta_bic < VERY_STRONG or law.gain.p_value > SIGNIFICANT:
        return None
    return law if result.rms >= VISIBLE * law.rms else None


def null_inside(name: str, result: FitResult) -> bool:
    """Tell whether the interval of an effect's decisive (first) parameter includes its null.

    A profile is decided by its gain alone: it has no single parameter.
    """
    if EFFECTS[name].profile:
        return False
    parameter = EFFECTS[name].parameters[0]
    index = next(i for i, s in enumerate(result.problem.shared) if (s.effect, s.name) == (name, parameter.name))
    low, high = interval(result, covariance(result), index)
    at_null = bool(np.isclose(result.x[index] * result.problem.shared[index].scale, parameter.null))
    return at_null or low <= parameter.null <= high
