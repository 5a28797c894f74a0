"""Effects added one by one: the way that gains most first, and others where that one ends in doubt."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from estimator.diagnosis.beyond import line_beyond
from estimator.diagnosis.evidence import VERY_STRONG, gain, information
from estimator.diagnosis.hypotheses import NOTHING, Effects, Progress, crowding, flexible
from estimator.diagnosis.lookalikes import lookalikes
from estimator.diagnosis.selection.jury import Jury, generalises
from estimator.diagnosis.selection.outcome import Selection
from estimator.diagnosis.selection.outdone import outdone
from estimator.diagnosis.selection.rounds import Rounds
from estimator.diagnosis.selection.surveys import Surveys
from estimator.diagnosis.trial import Trial
from estimator.diagnosis.unnamed import each_of
from estimator.diagnosis.weight import NEAR_NOISE, SEEN, VISIBLE, leaves_a_detail, reads_speed
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult
from estimator.physics.parallel import concurrently

MOST_EFFECTS = 4

PART_OF_REST = 0.25
"""Share of what still stands above the noise that a first look must promise for a further effect to be fitted: of two
effects that were there, the second promised a third or more (seventy sealed pairs); beside what only imitates, less."""

PART_IN_PLACE = 0.2
"""Share of what an effect that bends explains beside others that a first look at a law must promise for it to be tried
in its place: those that took its place promised a third of it or more (five hundred sealed cases)."""

PATIENCE = 4
"""How many times its iterations a fit may take on which a verdict is built."""

OTHER_WAYS = 3
"""Effects that another way begins with, those that by themselves leave least."""


@dataclass(frozen=True, slots=True)
class _Path:
    """Effects chosen so far, their fit, and the trial of each."""

    chosen: Effects
    current: FitResult
    accepted: Mapping[str, Trial]


def _by_no_steps(result: FitResult) -> bool:
    return False


class Selector:
    """Runs the selection before one jury.

    ``is_made_by_steps`` tells whether the steps of the integration have a part in what a fit leaves: nothing is added
    to it then.
    """

    def __init__(
        self, jury: Jury, progress: Progress, is_made_by_steps: Callable[[FitResult], bool] = _by_no_steps
    ) -> None:
        self.jury = jury
        self._is_made_by_steps = is_made_by_steps
        self._progress = progress
        self._rounds = Rounds(jury, progress)
        self._surveys = Surveys(jury.weight)
        self._gone: set[str] = set()  # effects that a way has begun with
        self._put_off: _Path | None = None  # two that get a third only if no other way ends better
        self._unfinished = False  # steps have a part in what a path leaves

    def run(self) -> Selection:
        """Add effects while one earns its place; then drop those that the others made superfluous."""
        retuned = self._to_its_end(NOTHING)
        path = self._grown(_Path(NOTHING, retuned, {}), retuned)
        return self._concluded(self._stiffened(path, retuned), retuned)

    def taken_over(self, found: Selection) -> Selection | None:
        """Return a selection made on other steps of the integration, gone on with on these; None if it leaves more.

        What the others had to mend of the steps alone is superfluous there. Whether laws do in the place of what bends
        does not depend on the steps.
        """
        result = self.jury.bench.go_on_from(found.result)
        if result.rms > VISIBLE * found.result.rms:
            return None
        self._rounds.trials, self._rounds.dismissed = dict(found.trials), dict(found.dismissed)
        self._gone |= found.chosen if len(found.chosen) == 1 else NOTHING
        retuned = self._to_its_end(NOTHING)
        chosen, current = self._drop_superfluous(found.chosen, result, retuned)
        accepted = {name: found.accepted[name] for name in chosen}
        return self._concluded(self._grown(_Path(chosen, current, accepted), retuned), retuned)

    def may_imitate(self, selection: Selection) -> bool:
        """Tell whether a choice came near the noise by bending: some law still finds something in what it leaves."""
        return self._has_bent(selection.chosen, selection.result) and selection.remaining is not None

    def by_other_ways(self, selection: Selection) -> Selection:
        """Return the best of a selection that is in doubt and of those that begin with other effects.

        Of two effects that hide each other none passes alone: each moves the free run by more than what the other
        leaves, and pays for itself out of an error that stays correlated. And a load profile, or an event whose
        moments are sought, bends to imitate two at once: where it came near the noise, the ways go without it.
        Two are looked at once, from the one that by itself leaves less: what the other adds shows there. A profile
        hides that. Where one law without a name explains all by itself there are not two. A way that does not end near
        the noise of a speed would be doubted as well.
        """
        retuned = selection.retuned
        if not self._has_bent(selection.chosen, selection.result):
            selection = replace(selection, hunts=self._surveys.whole(retuned).hunts)
            if self._surveys.is_one_law(retuned, selection.result):
                return selection
        old = path = _Path(selection.chosen, selection.result, selection.accepted)
        without = flexible(path.chosen) if self._is_near(path.current) else NOTHING
        gone = NOTHING if flexible(path.chosen) else frozenset(self._gone)
        for first in self._rounds.finished_first(retuned, without, OTHER_WAYS):
            if first.name not in gone:
                way = self._completed(first, retuned, without)
                if self._is_near(way.current) or not reads_speed(way.current):
                    path = self._better(path, way, retuned)
            without |= NOTHING if EFFECTS[first.name].profile else {first.name}
            if path is not old and self._is_near(path.current):
                if not flexible(path.chosen) or self._surveys.law(path.current) is None:
                    break
        if path is not old:
            return self._concluded(self._stiffened(self._grown(path, retuned), retuned), retuned)
        two = self._put_off
        three = two if two is None else self._grown(two, retuned, far=True)
        if three is None or three is two:
            return selection
        return self._concluded(self._stiffened(three, retuned), retuned)

    def _has_bent(self, chosen: Effects, result: FitResult) -> bool:
        """Tell whether what bends is among effects that came near the noise."""
        return bool(flexible(chosen)) and self._is_near(result)

    def _completed(self, first: Trial, retuned: FitResult, without: Effects) -> _Path:
        """Return the way that begins with an effect, and ends there or with one that completes the explanation.

        Near the noise laws alone complete laws: what bends takes up any rest, or leaves one to be taken up.
        """
        way = self._with(_Path(NOTHING, retuned, {}), first, retuned)
        if self._is_near(way.current):
            if flexible(way.chosen) or not self._has_rest(way.current, retuned):
                return way
            without |= flexible(frozenset(EFFECTS))
        without |= self._outdone(way, retuned)
        trials = self._rounds.try_all(way.chosen, way.current, without, 0.5 * self._rest(way.current))
        best = self.jury.best(trials, way.current, retuned)
        return way if best is None else self._with(way, best, retuned)

    def _concluded(self, path: _Path, retuned: FitResult) -> Selection:
        chosen, current = path.chosen, path.current
        if any(EFFECTS[name].event for name in chosen):
            current = self.jury.bench.settle(chosen)
        accepted = {
            name: self.jury.final(name, chosen, current, trial)
            for name, trial in path.accepted.items()
            if name in chosen
        }
        named = chosen if self.jury.weight.may_stand(current, retuned) else NOTHING
        alike = {name: lookalikes(name, chosen, current, self.jury.bench, self.jury.names) for name in named}
        self._progress("looking for laws without a name", 0.9)
        first, *remaining = each_of(retuned, self._surveys.of, [retuned, current] if chosen else [retuned])
        return Selection(
            retuned,
            chosen,
            current,
            accepted,
            self._rounds.trials,
            self._rounds.dismissed,
            alike,
            unnamed=first.law,
            remaining=remaining[0].law if remaining else None,
            beyond=line_beyond(retuned),
            hunts=self._surveys.furthest(retuned).hunts,
            unfinished=self._unfinished,
        )

    def _grown(self, path: _Path, retuned: FitResult, far: bool = False) -> _Path:
        """Add effects to a path while one earns its place.

        A further round of fits is only made where some law, named or not, still has something to explain. Two that are
        far from explaining it get a third only where ``far`` is True: other ways to begin are gone first.
        """
        for _ in range(MOST_EFFECTS - len(path.chosen)):
            if path.chosen and not self._has_rest(path.current, retuned):
                break
            if len(path.chosen) > 1 and not far and self._is_far(path.current, retuned):
                self._put_off = path
                break
            least = self._least_promise(path, retuned)
            without = crowding(path.chosen) | self._outdone(path, retuned)
            trials = self._rounds.try_all(path.chosen, path.current, without, least)
            best = self.jury.best(trials, path.current, retuned)
            self._rounds.let_go(path.current if best is None else best.result)
            if best is None:
                break
            if not path.chosen:
                self._gone.add(best.name)
            path = self._with(path, best, retuned)
            if self._has_rest(path.current, retuned):  # before another is named for the rest
                path = replace(path, current=self._fitted_widely(path.chosen))
                self._unfinished = self._is_made_by_steps(path.current)
                if self._unfinished:
                    break
        return path

    def _fitted_widely(self, chosen: Effects) -> FitResult:
        """Return the best fit of effects from further starts: of one alone, those that promised little; and anew."""
        for alone in chosen if len(chosen) == 1 else ():
            self.jury.bench.fit_widely(chosen, alone)
        return self.jury.bench.fit_in_stretches(chosen)

    def _stiffened(self, path: _Path, retuned: FitResult) -> _Path:
        """Return a path with a law in the place of what bends beside others, where one explains the rest better.

        From where that has brought the others, too: an event whose moments are off leaves a law nothing to explain.
        Where a law without a name does, what bends is left out. Where all of them leave too much to be named, another
        way is worth more.
        """
        for name in sorted(flexible(path.chosen)):
            if (
                name not in path.chosen
                or len(path.chosen) == 1
                or not self.jury.weight.may_stand(path.current, retuned)
            ):
                continue
            rest = path.chosen - {name}
            current = self.jury.bench.fit_less(rest, path.current)
            without = flexible(frozenset(EFFECTS)) | self._outdone(replace(path, chosen=rest), retuned)
            trials = self._rounds.try_all(
                rest, current, without, PART_IN_PLACE * (current.squares - path.current.squares)
            )
            trials |= self._rounds.try_in_place(name, path.current, list(trials), rest, current)
            best = self.jury.best(trials, current, retuned)
            if best is not None:
                path = self._better(path, self._with(_Path(rest, current, path.accepted), best, retuned), retuned)
            law = self._surveys.law(current) if name in path.chosen and len(path.chosen) > 1 else None
            if law is not None and VISIBLE * law.rms <= path.current.rms:
                path = _Path(rest, current, path.accepted)
        return path

    def _with(self, path: _Path, best: Trial, retuned: FitResult) -> _Path:
        """Return a path with the effects of a trial, less those it made superfluous, and these as simple as will do."""
        whole = self._to_its_end(best.effects, best.result, retuned)
        chosen, current = self._simplified(*self._drop_superfluous(best.effects, whole, retuned))
        trials = {**path.accepted, best.name: best}
        return _Path(chosen, current, {name: trials.get(name, best) for name in chosen})

    def _to_its_end(
        self, effects: Effects, warm: FitResult | None = None, retuned: FitResult | None = None
    ) -> FitResult:
        """Return a fit that may take its iterations several times, unless it leaves too much for a verdict anyway."""
        result = self.jury.bench.fit(effects, warm)
        for _ in range(PATIENCE - 1):
            if result.converged or (retuned is not None and not self.jury.weight.may_stand(result, retuned)):
                break
            result = self.jury.bench.fit(effects, result)
        return result

    def _better(self, path: _Path, other: _Path, retuned: FitResult) -> _Path:
        """Return the better of two paths; where nothing was found, another way must end near the noise."""
        if not self._stands(other) or not (path.chosen or self._is_near(other.current)):
            return path
        n = gain(retuned, min(path.current, other.current, key=lambda fit: fit.squares)).n_effective
        return other if information(path.current, other.current, n) > 0.0 else path

    def _stands(self, path: _Path) -> bool:
        """Tell whether every effect of a path passes beside the others, on unseen data too."""
        for name in path.chosen:
            without = self.jury.bench.fit(path.chosen - {name}, path.current)
            trial = self.jury.trial(name, path.chosen, without, path.current)
            if trial.failed is not None or not self.jury.holds_out(trial, without):
                return False
        return True

    def _drop_superfluous(self, chosen: Effects, current: FitResult, retuned: FitResult) -> tuple[Effects, FitResult]:
        names = sorted(chosen) if len(chosen) > 1 else []
        fewer = concurrently(lambda name: self.jury.bench.fit_less(chosen - {name}, current), names)
        for name, without in zip(names, fewer, strict=True):
            gained = gain(without, current)
            if gained.delta_bic < VERY_STRONG or not self.jury.weight.counts(name, chosen, current, without, retuned):
                return self._drop_superfluous(chosen - {name}, without, retuned)
        return chosen, current

    def _simplified(self, chosen: Effects, current: FitResult) -> tuple[Effects, FitResult]:
        """Return effects with a general law's special case in its place, where that does beside the others."""
        for name in sorted(chosen) if len(chosen) > 1 else ():
            for special in set(EFFECTS[name].contains) & set(self.jury.names):
                without = self.jury.bench.fit(chosen - {name}, current)
                simpler = self.jury.bench.fit(chosen - {name} | {special}, without)
                if not generalises(simpler, current, without):
                    return chosen - {name} | {special}, simpler
        return chosen, current

    def _outdone(self, path: _Path, retuned: FitResult) -> Effects:
        """Return effects that could not be believed beside those of a path; beside none any may be.

        A first look for a law tells, but before a third effect is added to two that leave what is seen: then a law is
        looked for to the end, which takes no longer than a round of such fits.
        """
        if not path.chosen:
            return NOTHING
        seen = path.current.rms > SEEN * self.jury.weight.level(path.current)
        law = self._surveys.whole(retuned).law if seen and len(path.chosen) > 1 else self._surveys.law(retuned)
        return outdone(law, retuned, self.jury.weight.level(retuned), path.chosen, self.jury.names)

    def _is_near(self, result: FitResult) -> bool:
        return result.rms <= NEAR_NOISE * self.jury.weight.level(result)

    def _is_far(self, result: FitResult, retuned: FitResult) -> bool:
        """Tell whether a fit of a speed leaves much more than the noise, and more than a detail of the mismatch."""
        if self._is_near(result) or not reads_speed(result):
            return False
        return not leaves_a_detail(retuned, result, self.jury.weight.floor)

    def _least_promise(self, path: _Path, retuned: FitResult) -> float:
        """Return by how much an effect must promise to lower the squared error of a path to be fitted.

        Where two leave too much to stand, a third must promise to complete them: what imitates takes a little each
        time. So must a second where one law without a name would do for both. Where they may stand, to come near the
        noise, or half the way. Beside a profile a first look promises too little: it has taken up part of what is
        another's. So may any law where next to nothing is left.
        """
        rest = self._rest(path.current)
        stands = self.jury.weight.may_stand(path.current, retuned)
        if len(path.chosen) > 1 and not stands:
            return 0.5 * rest
        if (
            path.chosen
            and self._surveys.may_be_one_law(retuned, path.current)
            and self._surveys.is_one_law(retuned, path.current)
        ):
            return 0.5 * rest
        if not path.chosen or self._is_near(path.current) or any(EFFECTS[name].profile for name in path.chosen):
            return 0.0
        if len(path.chosen) > 1 and reads_speed(path.current):
            near = NEAR_NOISE * self.jury.weight.level(path.current)
            return max(
                PART_OF_REST * rest, min(0.5 * rest, path.current.squares - near**2 * path.current.residual.size)
            )
        return PART_OF_REST * rest

    def _rest(self, result: FitResult) -> float:
        """Return the squared error that a fit leaves above the noise."""
        return max(result.squares - self.jury.weight.level(result) ** 2 * result.residual.size, 0.0)

    def _has_rest(self, current: FitResult, retuned: FitResult) -> bool:
        """Tell whether what a fit leaves could make another effect count, and is no noise.

        Next to the noise some law without a name must find something in it.
        """
        if not self.jury.weight.leaves_room(current, retuned):
            return False
        return current.rms >= VISIBLE * self.jury.weight.level(current) or self._surveys.law(current) is not None
