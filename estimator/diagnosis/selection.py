"""Which effects are missing: forward addition and backward removal, each step judged by five tests.

An effect earns its place when

1. information: the BIC gains more than ``VERY_STRONG`` (residual correlation taken into account);
2. chance: its p-value, times the number of hypotheses tried (Bonferroni), is below ``SIGNIFICANT``;
3. null: the 95 % interval of its decisive parameter excludes the value at which it does nothing;
4. unseen data: the error on held-out samples falls;
5. weight: it removes a part of the mismatch that is more than the difference between two ways to write one law.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from estimator.diagnosis.evidence import VERY_STRONG, Gain, gain, information
from estimator.diagnosis.holdout import Examiner, HoldOut
from estimator.diagnosis.hypotheses import NOTHING, Bench, Effects, Progress, effects_of, with_effect
from estimator.diagnosis.intervals import Z95, chance_of_coherent, reported_covariance
from estimator.diagnosis.lookalikes import lookalikes
from estimator.diagnosis.screening import Look, Screen, promising
from estimator.diagnosis.trial import (
    Trial,
    has_edge,
    healed_in,
    null_inside,
    pressed_parameters,
    ranks,
    scan_choices,
    values_of,
)
from estimator.diagnosis.unnamed import UnnamedLaw, best_unnamed
from estimator.diagnosis.weight import VISIBLE, Weight, earns_detail
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.parallel import concurrently

SIGNIFICANT = 0.05
"""Probability of a gain by chance that this test accepts per diagnosis, all hypotheses together; four others follow."""

MOST_EFFECTS = 4

WORTH_FITTING = 0.2
"""Share of the best first look's promise below which an effect is not fitted."""

MOST_FITS = 10
"""Effects that are fitted in a round, the most promising ones."""

WORTH_FINISHING = 0.5
"""Share of the best rough fit's gain below which a rival's fit is not finished."""

PART_UNSEEN = 0.25
"""Share of the relative gain on fitted samples that must show on unseen ones; an effect may act mostly elsewhere."""

NEAR_NOISE = 1.5
"""Error over the noise floor above which a choice is compared with what can be found behind a slow load."""


@dataclass(frozen=True, slots=True)
class Selection:
    """The outcome of a selection.

    Attributes
    ----------
    chosen : frozenset of str
        The effects that earned their place; ``result`` is their fit, ``retuned`` the one without any.
    accepted : mapping of str to Trial
        Each chosen effect's last trial.
    trials : mapping of str to Trial
        The first trial of every effect that was fitted.
    dismissed : mapping of str to float
        Effects not worth a fit: the share of the squared error that a first look found them to explain.
    lookalikes : mapping of str to tuple of str
        Per chosen effect, those that explain the same as well: the recordings can't tell them apart.
    unnamed : UnnamedLaw or None
        The best law without a name for what the re-tuned nominal leaves, where it counts.
    remaining : UnnamedLaw or None
        The best one for what the chosen effects leave, where it counts.
    """

    retuned: FitResult
    chosen: Effects
    result: FitResult
    accepted: Mapping[str, Trial]
    trials: Mapping[str, Trial]
    dismissed: Mapping[str, float]
    lookalikes: Mapping[str, tuple[str, ...]]
    unnamed: UnnamedLaw | None
    remaining: UnnamedLaw | None


@dataclass(frozen=True, slots=True)
class _Path:
    """Effects chosen so far, their fit, and the trial of each."""

    chosen: Effects
    current: FitResult
    accepted: Mapping[str, Trial]


@dataclass
class Selector:
    """Runs the selection on one bench.

    Attributes
    ----------
    names : sequence of str
        Effects that the recordings can tell.
    weight : Weight
        What counts in these recordings.
    """

    bench: Bench
    examiner: Examiner
    names: Sequence[str]
    weight: Weight
    progress: Progress
    _rounds: int = 0
    _trials: dict[str, Trial] = field(default_factory=dict)
    _dismissed: dict[str, float] = field(default_factory=dict)
    _laws: dict[int, tuple[FitResult, UnnamedLaw | None]] = field(default_factory=dict)

    def run(self) -> Selection:
        """Add effects while one earns its place; then drop those that the others made superfluous.

        Where that ends far from the noise, another way is tried: behind a slow load.
        """
        retuned = self.bench.fit(NOTHING)
        path = self._grown(_Path(NOTHING, retuned, {}), retuned)
        if not path.chosen or path.current.rms > NEAR_NOISE * self.weight.level(path.current):
            path = self._better(path, self._behind_profile(retuned), retuned)
        chosen, current = path.chosen, path.current
        if any(EFFECTS[name].event for name in chosen):
            current = self.bench.settle(chosen)
        accepted = {
            name: self._final(name, chosen, current, trial) for name, trial in path.accepted.items() if name in chosen
        }
        alike = {name: lookalikes(name, chosen, current, self.bench, self.names) for name in chosen}
        self._report("looking for laws without a name", 0.9)
        return Selection(
            retuned,
            chosen,
            current,
            accepted,
            self._trials,
            self._dismissed,
            alike,
            unnamed=self._law(retuned),
            remaining=self._law(current) if chosen else None,
        )

    def _grown(self, path: _Path, retuned: FitResult) -> _Path:
        """Add effects to a path while one earns its place.

        A further round of fits is only made where some law, named or not, still has something to explain.
        """
        for _ in range(MOST_EFFECTS - len(path.chosen)):
            best = self._best(self._try_all(path.chosen, path.current), path.current, retuned)
            self._let_go(path.current if best is None else best.result)
            if best is None:
                break
            path = self._with(path, best, retuned)
            if self._is_noise(path.current):
                break
        return path

    def _let_go(self, kept: FitResult) -> None:
        """Let the derivatives of what lost a round go."""
        self.bench.let_go(effects_of(kept))
        self._trials = {name: replace(trial, result=trial.result.light()) for name, trial in self._trials.items()}

    def _with(self, path: _Path, best: Trial, retuned: FitResult) -> _Path:
        """Return a path with the effects of a trial, less those it made superfluous."""
        accepted = {name: path.accepted.get(name, best) for name in best.effects} | {best.name: best}
        whole = self.bench.fit(best.effects, best.result)
        return _Path(*self._drop_superfluous(best.effects, whole, retuned), accepted)

    def _better(self, path: _Path, other: Trial | None, retuned: FitResult) -> _Path:
        """Return the better of a path and the one that another first trial begins."""
        if other is None:
            return path
        begun = self._grown(self._with(_Path(NOTHING, retuned, {}), other, retuned), retuned)
        n = gain(retuned, begun.current).n_effective
        return begun if information(path.current, begun.current, n) > 0.0 else path

    def _law(self, result: FitResult) -> UnnamedLaw | None:
        """Return the law without a name that counts for what a fit leaves; each fit is searched once."""
        known = self._laws.get(id(result))
        if known is None:
            known = self._laws[id(result)] = (result, counting_law(result))
        return known[1]

    def _is_noise(self, result: FitResult) -> bool:
        """Tell whether what a fit leaves is next to the noise, and no law without a name finds anything in it."""
        return result.rms < VISIBLE * self.weight.level(result) and self._law(result) is None

    def _behind_profile(self, retuned: FitResult) -> Trial | None:
        """Look for an effect behind a slow load that by itself hides it, where something stands.

        A slow disturbance moves the free run by many times what a fast effect does; and alone it must pay for all its
        knots out of an error that the fast effect keeps correlated. Both are judged again in the final set.
        """
        profiles = [name for name in self.names if EFFECTS[name].profile]
        if not profiles or self._law(retuned) is None:
            return None
        slow = frozenset(profiles[:1])
        behind = self.bench.fit(slow, retuned)
        if behind.rms**2 > 0.5 * retuned.rms**2:  # nothing slow dominates: there is nothing to look behind
            return None
        return self._best(self._try_all(slow, behind), behind, retuned)

    def _try_all(self, chosen: Effects, current: FitResult) -> dict[str, Trial]:
        """Look at every effect, fit what could matter a few steps, and to the end what comes near the best."""
        superseded = {name for have in chosen for name in EFFECTS[have].contains}
        names = [name for name in self.names if name not in chosen and name not in superseded]
        looks = self._looks(names, chosen, current)
        titles = ", ".join(EFFECTS[name].title for name in looks)
        self._report(f"testing {titles}", 0.3)
        fits = concurrently(
            lambda name: self.bench.rough_fit(
                with_effect(chosen, name), current, [look.release for look in looks[name]]
            ),
            list(looks),
        )
        rough = dict(zip(looks, fits, strict=True))
        most = max((current.squares - result.squares for result in rough.values()), default=0.0)
        self._report("finishing the best of them", 0.7)

        def finished(name: str) -> Trial:
            effects = with_effect(chosen, name)
            near = current.squares - rough[name].squares >= WORTH_FINISHING * most
            result = self.bench.fit(effects, current) if near else rough[name]
            return self._trial(name, effects, current, result)

        trials = dict(zip(rough, concurrently(finished, list(rough)), strict=True))
        self._rounds += 1
        self._trials = trials | self._trials
        return trials

    def _looks(self, names: Sequence[str], chosen: Effects, current: FitResult) -> dict[str, list[Look]]:
        """Return the looks worth a fit: what promises a fair part of the best, or contains a chosen effect.

        And what would let a parameter go that is pressed against its bound.
        """
        self._report("looking at every effect", 0.0)
        screen = Screen(current, self.bench.model)
        looks = dict(zip(names, concurrently(screen.looks, names), strict=True))
        promises = {name: found[0].promise for name, found in looks.items()}
        most = max((promise for promise in promises.values() if math.isfinite(promise)), default=0.0)
        least = current.squares * -math.expm1(-VERY_STRONG / current.residual.size)
        pressed = pressed_parameters(current)
        worth = [name for name in names if EFFECTS[name].loosens & pressed]
        for name in sorted(names, key=lambda name: -promises[name]):
            special = set(EFFECTS[name].contains)
            related = bool(special & chosen) or bool(special & set(worth))
            if name not in worth and (related or promises[name] >= max(WORTH_FITTING * most, least)):
                worth.append(name)
        if not chosen:
            self._dismissed = {
                name: max(promises[name], 0.0) / current.squares for name in names if name not in worth[:MOST_FITS]
            }
        return {name: promising(looks[name]) for name in worth[:MOST_FITS]}

    def _report(self, what: str, part: float) -> None:
        share = 0.9 * (1.0 - 0.5**self._rounds * (1.0 - 0.5 * part))  # a round is half of the rest
        self.progress(what, share)

    def _trial(self, name: str, effects: Effects, before: FitResult, after: FitResult) -> Trial:
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
        values = values_of(name, result)
        entry, given = EFFECTS[name], (self.bench.model, self.bench.records, values)
        return entry.implausible(*given) or entry.unresolved(*given) or None

    def _best(self, trials: Mapping[str, Trial], current: FitResult, retuned: FitResult) -> Trial | None:
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
            elif self._beyond_rest(simpler, current) and self._holds_out(simpler, current):
                return self._examined(simpler, current)
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
            if special is not None and special.failed is None:
                more = gain(special.result, trial.result)
                if more.delta_bic < VERY_STRONG or not earns_detail(special.result, trial.result, current):
                    return special
        return trial

    def _examine(self, trial: Trial, before: FitResult) -> HoldOut:
        return self.examiner.compare(before, effects_of(before), trial.result, trial.effects)

    def _holds_out(self, trial: Trial, before: FitResult) -> bool:
        """Tell whether a fair part of the gain on the fitted samples shows on unseen ones, as far as these can tell.

        Where the unseen ones are at the noise already there is nothing to gain: an effect may not show in them.
        """
        held = self._examine(trial, before)
        seen = 1.0 - (trial.result.rms / before.rms) ** 2
        unseen = 1.0 - (held.after / held.before) ** 2
        level = self.weight.level(trial.result)
        possible = 1.0 - (level / held.before) ** 2 if held.before > VISIBLE * level else 0.0
        return unseen + Z95 * held.spread >= PART_UNSEEN * min(seen, possible)

    def _examined(self, trial: Trial, before: FitResult) -> Trial:
        return replace(trial, holdout=self._examine(trial, before), failed=None)

    def _drop_superfluous(self, chosen: Effects, current: FitResult, retuned: FitResult) -> tuple[Effects, FitResult]:
        for name in sorted(chosen) if len(chosen) > 1 else ():
            without = self.bench.fit(chosen - {name}, current)
            gained = gain(without, current)
            if gained.delta_bic < VERY_STRONG or not self.weight.counts(name, chosen, current, without, retuned):
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
