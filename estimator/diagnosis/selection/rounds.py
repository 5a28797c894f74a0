"""A round: every effect looked at on top of those chosen, and what could matter fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from estimator.diagnosis.evidence import VERY_STRONG
from estimator.diagnosis.hypotheses import NOTHING, Effects, Progress, effects_of, flexible, with_effect
from estimator.diagnosis.screening import Look, Screen, promising
from estimator.diagnosis.selection.jury import Jury
from estimator.diagnosis.trial import Trial, pressed_parameters
from estimator.diagnosis.weight import NEAR_NOISE
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.parallel import concurrently

WORTH_FITTING = 0.2
"""Share of the best first look's promise below which an effect is not fitted."""

MOST_FITS = 10
"""Effects that are fitted in a round, the most promising ones."""

WORTH_GOING_ON, WORTH_FINISHING = 0.5, 0.8
"""Share of the best fit's gain below which a rival's fit stays as it is, after the first few steps and a few more. What
bends gains in fewer steps: at first, laws are held against the best of them, too."""

TOO_LATE = 16.0
"""Squared error over the best fit's beyond which not even what sets others free is finished: the best is chosen first.
"""

FAR_BEHIND = 1.5
"""Error over that of the effect that by itself leaves least beyond which no other way begins with one: those that found
what was hidden began within a hundredth of it (seven of five hundred sealed cases)."""


@dataclass
class Rounds:
    """Tries effects, and remembers the first trial of each.

    Attributes
    ----------
    trials : mapping of str to Trial
        The first trial of every effect that was fitted.
    dismissed : mapping of str to float
        Effects not worth a fit in the first round, with the share of the squared error they promise to explain.
    """

    jury: Jury
    progress: Progress
    trials: dict[str, Trial] = field(default_factory=dict)
    dismissed: dict[str, float] = field(default_factory=dict)
    _count: int = 0
    _seen: dict[tuple[Effects, bytes], dict[str, list[Look]]] = field(default_factory=dict)

    def try_all(
        self, chosen: Effects, current: FitResult, without: Effects = NOTHING, least: float = 0.0
    ) -> dict[str, Trial]:
        """Look at every effect but some, fit what could matter a few steps, and to the end what stays near the best.

        ``least`` is the fall of the squared error that an effect must promise to be fitted.
        """
        superseded = {name for have in chosen for name in EFFECTS[have].contains}
        names = [name for name in self.jury.names if name not in chosen | superseded | without]
        looks = self._looks(names, chosen, current, least)
        titles = ", ".join(EFFECTS[name].title for name in looks)
        self._report(f"testing {titles}", 0.3)
        fits = concurrently(
            lambda name: self.jury.bench.rough_fit(
                with_effect(chosen, name), current, [look.release for look in looks[name]]
            ),
            list(looks),
        )
        rough = dict(zip(looks, fits, strict=True))
        self._report("finishing the best of them", 0.7)
        laws = {name: result for name, result in rough.items() if not flexible(frozenset({name}))}
        near = {*_near_the_best(rough, current, WORTH_GOING_ON), *_near_the_best(laws, current, WORTH_GOING_ON)}
        lost = {name for name, result in rough.items() if result.squares > current.squares}  # it holds that fit's, too
        further = [name for name in rough if name in near | lost]
        if len(further) > 1:
            fits = concurrently(lambda name: self.jury.bench.go_on(with_effect(chosen, name)), further)
            rough |= dict(zip(further, fits, strict=True))
            further = _near_the_best(rough, current, WORTH_FINISHING)
        pressed = pressed_parameters(current)
        most = TOO_LATE * min((result.squares for result in rough.values()), default=0.0)
        freed = [name for name, fit in rough.items() if EFFECTS[name].loosens & pressed and fit.squares <= most]

        def finished(name: str) -> Trial:
            effects, result = with_effect(chosen, name), rough[name]
            if name in further or (name in freed and not chosen):  # what sets others free shows itself late
                ended = self.jury.bench.fit(effects, current)
                if EFFECTS[name].bounces and ended.rms > NEAR_NOISE * self.jury.weight.level(ended):
                    self.jury.bench.fit_in_stretches(effects)
                if name in freed:
                    self.jury.bench.fit_again(effects, name)
                result = self.jury.bench.fit_retold(effects, name)
            return self.jury.trial(name, effects, current, result)

        trials = dict(zip(rough, concurrently(finished, list(rough)), strict=True))
        if chosen:
            trials |= self._in_place_of_the_best(trials, chosen, current)
        self._count += 1
        self.trials = trials | self.trials
        return trials

    def _in_place_of_the_best(
        self, trials: Mapping[str, Trial], chosen: Effects, current: FitResult
    ) -> dict[str, Trial]:
        """Try the linear systems that look like the best, if it is one, in its place.

        Beside a gap the fit of one may end elsewhere, and then the wrong one of two look-alikes is named.
        """
        best = min((t for t in trials.values() if t.failed is None), key=lambda t: t.result.squares, default=None)
        if best is None or not EFFECTS[best.name].linear:
            return {}
        alike = [name for name in EFFECTS[best.name].resembles if name in trials and EFFECTS[name].linear]
        return self.try_in_place(best.name, best.result, alike, chosen, current)

    def try_in_place(
        self, rival: str, had: FitResult, names: Sequence[str], chosen: Effects, current: FitResult
    ) -> dict[str, Trial]:
        """Try effects beside those chosen from where a rival, in a fit that has it, has brought these.

        What a rival follows nearly as well has brought the others near their place; a fit from elsewhere may have not.
        Those are tried that promise, beside what moving the others back does, a fair part of what the rival explains,
        and those are finished that stay near the best of them.
        """
        placed = self.jury.bench.left_without(chosen, rival, had)
        least = placed.squares - current.squares + WORTH_FITTING * (current.squares - had.squares)
        looks = {name: found for name, found in self._around(placed, names).items() if found[0].promise >= least}

        def begun(name: str) -> FitResult:
            releases = [look.release for look in promising(looks[name])]
            return self.jury.bench.rough_in_place(with_effect(chosen, name), placed, releases)

        rough = dict(zip(looks, concurrently(begun, list(looks)), strict=True))

        def finished(name: str) -> Trial:
            effects = with_effect(chosen, name)
            return self.jury.trial(name, effects, current, self.jury.bench.finish_in_place(effects, rough[name]))

        near = _near_the_best(rough, current, WORTH_GOING_ON)
        return dict(zip(near, concurrently(finished, near), strict=True))

    def _looks(
        self, names: Sequence[str], chosen: Effects, current: FitResult, least: float = 0.0
    ) -> dict[str, list[Look]]:
        """Return the looks worth a fit: what promises a fair part of the best, or contains a chosen effect.

        And what would let a parameter go that is pressed against its bound.
        """
        self._report("looking at every effect", 0.0)
        looks = self._around(current, names)
        promises = {name: found[0].promise for name, found in looks.items()}
        most = max((promise for promise in promises.values() if math.isfinite(promise)), default=0.0)
        least = max(least, WORTH_FITTING * most, current.squares * -math.expm1(-VERY_STRONG / current.residual.size))
        pressed = pressed_parameters(current)
        worth = [name for name in names if EFFECTS[name].loosens & pressed]
        for name in sorted(names, key=lambda name: -promises[name]):
            special = set(EFFECTS[name].contains)
            related = bool(special & chosen) or bool(special & set(worth))
            if name not in worth and (related or promises[name] >= least):
                worth.append(name)
        if not chosen:
            self.dismissed = {
                name: max(promises[name], 0.0) / current.squares for name in names if name not in worth[:MOST_FITS]
            }
        return {name: promising(looks[name]) for name in worth[:MOST_FITS]}

    def _around(self, current: FitResult, names: Sequence[str]) -> dict[str, list[Look]]:
        """Return looks at effects from a fit, each made once: several ways lead past the same fit."""
        seen = self._seen.setdefault((effects_of(current), current.x.tobytes()), {})
        if new := [name for name in names if name not in seen]:
            seen.update(zip(new, concurrently(Screen(current, self.jury.bench.model).looks, new), strict=True))
        return {name: seen[name] for name in names}

    def _report(self, what: str, part: float) -> None:
        share = 0.9 * (1.0 - 0.5**self._count * (1.0 - 0.5 * part))  # a round is half of the rest
        self.progress(what, share)

    def finished_first(self, retuned: FitResult, without: Effects, most: int) -> list[Trial]:
        """Return effects of the first round that leave least, each fitted to its end, the one that leaves least first.

        Some are left out, and a general law where its special case is among them, and what is far behind the best;
        ``most`` is how many are wanted.
        """
        alone = {trial.name: trial for trial in self.trials.values() if len(trial.effects) == 1}
        able = [t for t in alone.values() if t.name not in without and not alone.keys() & set(EFFECTS[t.name].contains)]
        gains = sorted((retuned.squares - trial.result.squares for trial in able), reverse=True)
        if len(gains) > most:  # what is far behind them after a few steps is not among them at its end
            able = [t for t in able if retuned.squares - t.result.squares >= WORTH_GOING_ON * gains[most - 1]]

        def finished(trial: Trial) -> Trial:
            self.jury.bench.fit(trial.effects, retuned)
            result = self.jury.bench.fit_retold(trial.effects, trial.name)
            return self.jury.trial(trial.name, trial.effects, retuned, result)

        self._report("finishing all of them", 0.0)
        trials = concurrently(finished, able)
        self.trials |= {trial.name: trial for trial in trials}
        least = min((trial.result.rms for trial in trials), default=0.0)
        near = [trial for trial in trials if trial.result.rms <= FAR_BEHIND * least]
        return sorted(near, key=lambda trial: trial.result.squares)[:most]

    def let_go(self, kept: FitResult) -> None:
        """Let the derivatives of what lost a round go."""
        self.jury.bench.let_go(effects_of(kept))
        self.trials = {name: replace(trial, result=trial.result.light()) for name, trial in self.trials.items()}


def _near_the_best(fits: Mapping[str, FitResult], current: FitResult, share: float) -> list[str]:
    """Return the effects whose fits gain at least a share of what the best one does."""
    gains = {name: current.squares - result.squares for name, result in fits.items()}
    most = max(gains.values(), default=0.0)
    return [name for name, gained in gains.items() if gained >= share * most]
