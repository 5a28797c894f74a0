"""Fits: the sets of effects that were fitted to some recordings, each once; all that a search remembers.

A set is fitted in two depths. A *rough* fit takes a few steps, from where another set was fitted, and is compared with
others like it; a fit *to its end* decides. Both begin from known values: a fit of a set in which one effect is new, is
gone, or is written another way begins where the rest of it was fitted before.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from threading import Lock

import numpy as np

from estimator.diagnosis.inference.descent import ROUGH, WHOLE, Depth, Start, extended, fitted
from estimator.diagnosis.inference.disturbances import Limits, limits_of
from estimator.diagnosis.inference.hypotheses import GRADE, NOTHING, Catalogue, Effects, Hypothesis, spans_of
from estimator.diagnosis.inference.score_tests import Known, ScoredStart, WeightedScoreTests, promising
from estimator.diagnosis.inference.trials import Trials
from estimator.diagnosis.line.line import line_values
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.thresholds import Checks, Searching
from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, not_fitted, warm_start
from estimator.physics.layout import Grid, grid_for
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import Work
from estimator.physics.problem import Problem, make_problem, start_vector
from estimator.physics.unknowns import Release, Shared, nominal_unknowns, own_unknowns, released
from estimator.signals.record import BoolArray, Record

ROOM_BYTES = 2**27  # room that answers may take


@dataclass
class OutputChanges:
    """Changes of the output, by what was changed, around some motions."""

    # A fit, and for each recording changes by digest of what was changed.
    around: list[tuple[FitResult, list[Known]]] = field(default_factory=list)

    def near(self, fit: FitResult) -> list[Known]:
        """Return what is known around a motion that is nearly a fit's, by recording; empty where there is none."""
        for other, known in self.around:
            if _difference(fit, other) < Searching.SAME_MOTION:
                return known
        return [{} for _ in fit.problem.drives]

    def learn(self, fit: FitResult, found: Sequence[Known]) -> None:
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


@dataclass
class Fits:
    """Sets of effects fitted to recordings of a model's line.

    Attributes
    ----------
    use : sequence of ndarray, shape (N,) each
        Which samples of each recording count.
    names : sequence of str
        The effects that sets are made of.
    ended, rough : dict
        The best fit of each set: to its end, and of a few steps where its values are a case of it.
    implausible, foreseen : dict
        The best score of a set with an effect whose values are no case of it, and as a score test foresees it.
    """

    model: DrivelineModel  # nominal
    records: Sequence[Record]  # all of one kind of output
    use: Sequence[BoolArray]
    names: Sequence[str]
    grid: Grid | None = None  # steps of the simulation; None: chosen for these recordings
    work: Work = field(default_factory=Work)  # what was simulated so far
    ended: dict[Effects, Hypothesis] = field(default_factory=dict)  # by set
    rough: dict[Effects, Hypothesis] = field(default_factory=dict)
    started_from: dict[Effects, Effects] = field(default_factory=dict)  # by set
    implausible: dict[str, float] = field(default_factory=dict)  # by effect
    foreseen: dict[str, float] = field(default_factory=dict)
    limits: Limits = field(init=False)  # usual disturbances of these recordings, and their bounds
    free: Limits = field(init=False)  # the same for a load that walks as far as it likes
    catalogue: Catalogue = field(init=False)  # what sets are chosen among, with the odds that the model file gives
    trials: Trials = field(init=False)  # the sets that were tried in free simulation
    noise: float = field(init=False)  # of the reading, as its own past predicts it [unit of the output]
    _changes: OutputChanges = field(default_factory=OutputChanges)  # of the output, for score tests
    _done: set[tuple[str, Effects, str]] = field(default_factory=set)  # descents that need not be made again
    _lock: Lock = field(default_factory=Lock)  # sets are fitted in threads

    def __post_init__(self) -> None:
        self.limits, self.noise, self.trials = limits_of(self.records), noise_floor(self.records), Trials(self.model)
        self.free = self.limits.freed()
        given = {name: self.model.priors[name].odds for name in self.model.priors if name in self.names}
        odds = {name: value for name, value in given.items() if value is not None}
        self.catalogue = Catalogue(self.model, len(self.names), odds)

    @property
    def simulations(self) -> int:
        """Free runs of all recordings so far."""
        return round(self.work.samples / sum(r.time_s.size for r in self.records if r.lead is None))

    def scores(self) -> dict[str, float]:
        """Return the best score of a plausible set with each effect that was fitted, to its end or a few steps."""
        found: dict[str, float] = {}
        for each in (*self.ended.values(), *self.rough.values()):
            for name in each.effects if each.is_plausible else ():
                found[name] = min(each.score, found.get(name, math.inf))
        return found

    def is_first(self, what: str, effects: Effects, name: str) -> bool:
        """Tell whether something is done for a set and one of its effects for the first time."""
        key = (what, effects, name)
        with self._lock:
            is_new = key not in self._done
            self._done.add(key)
        return is_new

    def fit(self, effects: Effects, starts: Sequence[Start], depth: Depth) -> Hypothesis:
        """Fit a set from some starts and return the best; once more where its effects take a value off its sheet."""
        found = [fitted(effects, start, depth, self.catalogue) for start in starts]
        best = min([each for each in found if each.is_plausible] or found, key=lambda each: each.score)
        loose = widened(best, self.model)
        if loose is None:
            return best
        other = fitted(effects, replace(starts[0], initial=loose, sizes=best.sizes), depth, self.catalogue)
        is_better = other.is_plausible and (other.score < best.score or not best.is_plausible)
        return other if is_better else best

    def nothing(self) -> Hypothesis:
        """Return the fit of the nominal line alone."""
        if NOTHING not in self.ended:
            own = tuple(own_unknowns(self.model.effects, record) for record in self.records)
            problem = self._problem(NOTHING, Release(nominal_unknowns(self.model), own))
            start = Start(not_fitted(problem, start_vector(problem)), self.limits.usual, self.limits)
            self._keep(self.fit(NOTHING, [start], WHOLE), NOTHING)
        return self.ended[NOTHING]

    def without(self, current: Hypothesis, name: str) -> Hypothesis:
        """Fit a set without one of its effects, the others started where they are, once from each set.

        The smaller set may be known: from where it was started before it may have ended in a poorer optimum.
        """
        effects = current.effects - {name}
        if self.is_first("without", current.effects, name) or effects not in self.ended:
            result = self._reduced(current, name) if name != GRADE else current.result
            self._keep(self.fit(effects, [self._start(effects, result, current)], WHOLE), current.effects)
        return self.ended[effects]

    def exchanged(self, current: Hypothesis, name: str, other: str) -> Hypothesis | None:
        """Fit another effect in the place of one; None where no value is one."""
        reduced = self.without(current, name)
        rough = self.added(reduced, other, self.starts(reduced, other), current)
        return None if rough is None else self.finish(rough, current)

    def added(
        self, current: Hypothesis, name: str, starts: Sequence[ScoredStart], instead: Hypothesis | None = None
    ) -> Hypothesis | None:
        """Fit an effect on top of a set a few steps, from each of its starts; None where no value is a case of it.

        Where it takes the place of another effect, it is started and weighted as the set with that one: ``instead``. So
        is an effect of that set that starts elsewhere.
        """
        effects = with_effect(current.effects, name)
        is_again = instead is not None and name in instead.effects
        if effects in self.ended and not is_again:
            return self.ended[effects]
        rival = instead or current
        known = previous = current.result if is_again else rival.result
        for gone in rival.effects - effects - {GRADE}:
            previous = forgetting(previous, gone)
        begun: list[Start] = []
        for scored in starts:
            problem = self._extended(previous, effects, inheriting(name, scored.release, previous))
            initial = extended(problem, warm_start(problem, previous), known)
            begun.append(self._start(effects, initial, rival))
        best = self.fit(effects, begun, ROUGH)
        is_case = best.is_plausible
        with self._lock:
            self.started_from.setdefault(effects, rival.effects)
            if not is_case:
                self.implausible[name] = min(best.score, self.implausible.get(name, math.inf))
            elif effects not in self.rough or best.score < self.rough[effects].score:
                self.rough[effects] = best
        return best if is_case else None

    def rewritten(self, current: Hypothesis, name: str) -> Hypothesis | None:
        """Fit a set a few steps with one of its laws written other ways; None where it has no other one."""
        starts, result = [], current.result
        for other in EFFECTS[name].reparametrised(
            self.model, self.records, result.values_of(name), line_values(result)
        ):
            initial = with_line_values(forgetting(result, name), other.line)
            (release,) = released(name, self.model, self.records, [other.start])
            problem = self._extended(initial, current.effects, replace(release, own=((),) * len(self.records)))
            started = extended(problem, warm_start(problem, initial), result, anew=name)
            starts.append(self._start(current.effects, started, current))
        return self.fit(current.effects, starts, ROUGH) if starts else None

    def elsewhere(self, current: Hypothesis, name: str) -> Hypothesis | None:
        """Fit an event a few steps where a look at the set without it, the rest as it is, sees it."""
        without = self._reduced(current, name)
        reduced = replace(
            current,
            effects=current.effects - {name},
            result=replace(without, converged=without.derivative is not None),
        )
        return self.added(reduced, name, self.starts(reduced, name), current)

    def with_grade(self, current: Hypothesis) -> Hypothesis:
        """Fit a set with a load that walks far, which follows whatever is slow."""
        effects = current.effects | {GRADE}
        if not self.is_first("with a free load", current.effects, GRADE):
            return self.ended[effects]
        return self.finish(replace(current, effects=effects, limits=self.limits_of(effects)), current)

    def finish(self, rough: Hypothesis, rival: Hypothesis) -> Hypothesis:
        """Take a fit as far as a comparison with a rival needs; kept where it is the best of its set so far.

        One that is worse than what is known of its set may yet end elsewhere: a few steps do not tell.
        """
        if self.ended.get(rough.effects) is not rough:
            start = Start(rough.result, rough.sizes, rough.limits, rival.minus_twice_log)
            whole = self.fit(rough.effects, [start], WHOLE)
            self._keep(whole if whole.is_plausible else rough, rival.effects)
        return self.ended[rough.effects]

    def view(self, around: Hypothesis) -> WeightedScoreTests:
        """Return the score tests around a fit, which know what was simulated around others like it."""
        known = self._changes.near(around.result)
        return WeightedScoreTests(around, self.model, known)

    def learn(self, around: Hypothesis, view: WeightedScoreTests) -> None:
        """Keep what score tests simulated, for others like them."""
        self._changes.learn(around.result, view.found)

    def starts(self, reduced: Hypothesis, name: str) -> list[ScoredStart]:
        """Return the starts of an effect that are worth a fit, next to a set without it."""
        view = self.view(reduced)
        found = promising(view.starts(name))
        self.learn(reduced, view)
        return found

    def limits_of(self, effects: Effects) -> Limits:
        """Return the bounds of the disturbances under a set: a free course of the load has none."""
        return self.free if GRADE in effects else self.limits

    def _reduced(self, current: Hypothesis, name: str) -> FitResult:
        """Return the free run of a set without one of its effects, the rest as it is."""
        effects, result = current.effects - {name}, current.result
        problem = self._problem(effects, unknowns_of(result, (effects - {GRADE}) | set(self.model.effects)))
        return extended(problem, warm_start(problem, forgetting(result, name)), result)

    def _start(self, effects: Effects, initial: FitResult, rival: Hypothesis) -> Start:
        """Return a start of a set with the disturbances of the one that it will be compared with."""
        return Start(initial, rival.sizes, self.limits_of(effects), rival.minus_twice_log)

    def _extended(self, previous: FitResult, effects: Effects, release: Release) -> Problem:
        common = unknowns_of(previous, (effects - {GRADE}) | set(self.model.effects))
        own = tuple((*old, *mine) for old, mine in zip(common.own, release.own, strict=True))
        return self._problem(effects, Release((*common.shared, *release.shared), own))

    def _problem(self, effects: Effects, release: Release) -> Problem:
        nominal = {each.name: each for each in nominal_unknowns(self.model) if not each.effect}
        shared = [  # what an effect that is gone has loosened is tight again
            nominal.get(each.name, each) if not each.effect and not may_be_loose(each, effects, self.model) else each
            for each in release.shared
        ]
        grid = self.grid or grid_for(self.model, self.records)
        return make_problem(self.model, self.records, shared, own=release.own, use=self.use, grid=grid)

    def _keep(self, hypothesis: Hypothesis, started_from: Effects) -> None:
        with self._lock:
            self.started_from.setdefault(hypothesis.effects, started_from)
            known = self.ended.get(hypothesis.effects)
            if known is None or hypothesis.score < known.score:
                self.ended[hypothesis.effects] = hypothesis


def with_effect(effects: Effects, name: str) -> Effects:
    """Add an effect to a set; it replaces the special cases of itself."""
    return (effects - set(EFFECTS[name].contains)) | {name}


def inheriting(name: str, release: Release, previous: FitResult) -> Release:
    """Return a start of a general law that keeps what a fit of its special case has found out in another form.

    Friction that was seen to deflect before it slides does so with a Stribeck range, too: started without, such a fit
    is far behind the special case and would be given up.
    """
    found = {
        key: value for special in EFFECTS[name].contains for key, value in previous.values_of(special).items() if value
    }
    limits = {parameter.name: (parameter.low, parameter.high) for parameter in EFFECTS[name].parameters}

    def inherited(unknown: Shared) -> Shared:
        if unknown.low < unknown.high or unknown.name not in found:
            return unknown
        low, high = limits[unknown.name]
        return replace(unknown, low=low, high=high, start=min(max(found[unknown.name] / unknown.scale, low), high))

    return replace(release, shared=tuple(inherited(unknown) for unknown in release.shared))


def forgetting(result: FitResult, name: str) -> FitResult:
    """Return a fit as if the parameters of an effect that all recordings share had not been released in it."""
    keep = [shared.effect != name for shared in result.problem.shared]
    shared = tuple(each for each, kept in zip(result.problem.shared, keep, strict=True) if kept)
    left = [*keep, *[True] * (result.x.size - len(keep))]
    problem = replace(result.problem, shared=shared)
    return replace(result, problem=problem, x=result.x[left], derivative=None)  # which was found with the effect


def with_line_values(result: FitResult, line: Mapping[str, float]) -> FitResult:
    """Return a fit with some of the line's own parameters elsewhere, within what they are trusted to."""
    x = result.x.copy()
    for i, shared in enumerate(result.problem.shared):
        if not shared.effect and shared.name in line:
            x[i] = min(max(line[shared.name] / shared.scale, shared.low), shared.high)
    return replace(result, x=x)


def unknowns_of(previous: FitResult, effects: Collection[str]) -> Release:
    """Return the unknowns of a fit that belong to the line itself or to some effects."""
    wanted = {"", *effects}
    return Release(
        tuple(unknown for unknown in previous.problem.shared if unknown.effect in wanted),
        tuple(tuple(unknown for unknown in basis.own if unknown.effect in wanted) for basis in previous.problem.local),
    )


def widened(hypothesis: Hypothesis, model: DrivelineModel) -> FitResult | None:
    """Return a fit whose nominal parameters may leave their tolerances where its effects change them; None as it is."""
    result = hypothesis.result
    wide = spans_of(hypothesis, model)
    shared = tuple(
        replace(each, low=each.low / Checks.LOOSE, high=each.high * Checks.LOOSE)
        if pinned and not each.effect and each.name in wide and _is_tight(each, model)
        else each
        for each, pinned in zip(result.problem.shared, result.pinned, strict=False)
    )
    if shared == result.problem.shared:
        return None
    return replace(result, problem=replace(result.problem, shared=shared), converged=False)


def may_be_loose(shared: Shared, effects: Effects, model: DrivelineModel) -> bool:
    """Tell whether one of some effects changes a nominal parameter, so that it may leave its tolerance."""
    line = model.values()
    values = {name: dict.fromkeys((p.name for p in EFFECTS[name].parameters), 0.0) for name in effects - {GRADE}}
    return any(shared.name in EFFECTS[name].described(model, mine, line) for name, mine in values.items())


def _is_tight(shared: Shared, model: DrivelineModel) -> bool:
    return shared.low < shared.high <= 1.0 + model.parameters[shared.name].tolerance + Checks.ROUNDING
