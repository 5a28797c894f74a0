"""The search over sets of effects: add, drop, exchange, until no change lowers the score."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock

import numpy as np

from estimator.diagnosis.inference.checks import is_plausible, may_be_loose, widened
from estimator.diagnosis.inference.descent import extended
from estimator.diagnosis.inference.disturbances import Limits, limits_of
from estimator.diagnosis.inference.hypotheses import (
    GRADE,
    NOTHING,
    Catalogue,
    Effects,
    Hypothesis,
    Progress,
    compared,
    fitted,
    forgetting,
    inheriting,
    line_values,
    open_hypotheses,
    silent,
    unknowns_of,
    with_effect,
    with_line_values,
)
from estimator.diagnosis.inference.score_tests import CachedScoreTests, OutputChanges, ScoredStart, promising
from estimator.diagnosis.inference.standing import LEAST_NECESSITY
from estimator.diagnosis.inference.trials import Trials, necessity, noise_of
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, not_fitted, warm_start
from estimator.physics.layout import Grid, grid_for, slot
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import Work, concurrently
from estimator.physics.problem import Problem, make_problem, start_of, start_vector
from estimator.physics.simulate import simulate
from estimator.physics.steps import Moments, moments_of
from estimator.physics.unknowns import Release, nominal_unknowns, own_unknowns, released
from estimator.signals.record import BoolArray, Record

BLIND = "speed_sign_blind"
MOST_FITS = 6  # effects that are fitted on top of a hypothesis, the most promising of a first look
WORTH_FITTING = 0.1  # share of the best promise below which an effect is not fitted

FEWEST_FITS = 2
"""Effects that are fitted however little a first look promises: a gap shows only near its own width."""

SAME_PROMISE = 0.5  # share of what an effect promises that a look-alike must promise in its place

NEARLY = 0.3
"""Share of what an effect explains by which another's first few steps may be behind for it to be fitted to its end."""

FINISHED = 2  # best of these that are fitted to their end
STARTS = 5  # effects from each of which a search begins, the most promising

WORTH_ADDING = 0.15
"""Share of the squared free-run error beyond the noise that a law must take for a search to continue from it."""

MOST_EFFECTS = 8

COMMON = (
    "coulomb_friction_motor",
    "load_imbalance",
    "backlash",
    "actuator_lag",
    "transport_delay",
    "inverter_gain_mismatch",
    "aerodynamic_drag",
)
"""Laws that most machines have: each search begins from these, too, whatever a look at the bare line promises of them.
Dry friction, for one, shows little around a line that has settled on too much damping."""


@dataclass
class Search:
    """Hypotheses on a model and recordings; each set of effects is fitted once."""

    model: DrivelineModel
    records: Sequence[Record]
    use: Sequence[BoolArray]
    names: Sequence[str]
    grid: Grid | None = None
    visited: dict[Effects, Hypothesis] = field(default_factory=dict)  # those that were fitted to their end
    rough: dict[Effects, Hypothesis] = field(default_factory=dict)
    path: list[Hypothesis] = field(default_factory=list)
    rivals: dict[str, float] = field(default_factory=dict)
    implausible: dict[str, float] = field(default_factory=dict)  # the same of others
    foreseen: dict[str, float] = field(default_factory=dict)
    work: Work = field(default_factory=Work)  # what was simulated so far
    most: float = math.inf
    progress: Progress = silent
    stopped: bool = False
    answers: OutputChanges = field(default_factory=OutputChanges)
    _lessened: set[tuple[Effects, str]] = field(default_factory=set)
    _restarted: defaultdict[Effects, set[str]] = field(default_factory=lambda: defaultdict(set))
    _moments: dict[tuple[Effects, str], list[Moments]] = field(default_factory=dict)
    _limits: Limits | None = None
    _lock: Lock = field(default_factory=Lock)

    @property
    def limits(self) -> Limits:
        """Usual disturbances of these recordings and their bounds."""
        if self._limits is None:
            self._limits = limits_of(self.records)
        return self._limits

    def run(self) -> Hypothesis:
        """Return the best set of effects found, begun from each of the most promising effects."""
        self.path = self._climbed([self.nothing()])
        firsts = sorted((each for effects, each in self.visited.items() if len(effects) == 1), key=lambda h: h.score)
        for first in firsts[:STARTS]:
            if len(self.path[-1].effects) < 2:
                break
            if first.effects <= self.path[-1].effects or not self.is_plausible(first):
                continue
            if self._is_far_behind(first, firsts[0]):
                continue
            path = self._climbed([self.nothing(), first], self.path)
            if path[-1].score < self.path[-1].score:
                self.path = path
        return self.path[-1]

    def _climbed(self, path: list[Hypothesis], rival: Sequence[Hypothesis] = ()) -> list[Hypothesis]:
        """Return a way on which each set is better than the one before, to where no change lowers the score.

        It is given up where, from its second effect on, a set is worse than one of as few effects on a rival's way.
        """
        for _ in range(2 * MOST_EFFECTS):
            current = path[-1]
            self.progress("comparing hypotheses", 0.1 + 0.7 * len(path) / (len(path) + 3))
            if self.simulations >= self.most:
                self.stopped = True
                break
            count = len(current.effects)
            if count > 1 and any(len(r.effects) <= count and r.score < current.score for r in rival):
                break
            better = self._best_addition(current) if count < MOST_EFFECTS else None
            better = better if better is not None and self._simulates_better(better, current) else None
            better = better or self._best_drop(current) or self._best_exchange(current) or self._graded(current)
            if better is None:
                break
            path = [*path, better]
        return path

    def _simulates_better(self, larger: Hypothesis, smaller: Hypothesis) -> bool:
        """Tell whether a law that makes a set more probable also makes its free run better, by more than a little.

        What the form of a law leaves is predicted a little better by nearly every further law; a search that follows
        the likelihood alone wanders among sets of these.
        """
        if larger.effects <= smaller.effects:  # of the same laws, or fewer, a better fit
            return True
        one, other = self.trials.of([smaller, larger])
        return necessity(other, one, noise_of(larger)).value >= WORTH_ADDING

    def _is_far_behind(self, one: Hypothesis, best: Hypothesis) -> bool:
        """Tell whether another first effect clearly leaves so much less that no search need begin from this one."""
        mine, its = self.trials.of([one, best])
        return necessity(its, mine, noise_of(best)).least >= LEAST_NECESSITY

    @cached_property
    def catalogue(self) -> Catalogue:
        """What sets are chosen among, with the odds that the model file gives."""
        odds = {name: prior.odds for name, prior in self.model.priors.items() if prior.odds is not None}
        return Catalogue(len(self.names), {name: value for name, value in odds.items() if name in self.names})

    @cached_property
    def trials(self) -> Trials:
        """The sets that were tried in free simulation."""
        return Trials(self.model)

    @property
    def simulations(self) -> int:
        """Free runs of all recordings so far."""
        return round(self.work.samples / sum(r.time_s.size for r in self.records if r.lead is None))

    def nothing(self) -> Hypothesis:
        if NOTHING not in self.visited:
            own = tuple(own_unknowns(self.model.effects, record) for record in self.records)
            problem = self._problem(NOTHING, Release(nominal_unknowns(self.model), own))
            initial = not_fitted(problem, start_vector(problem))
            self._keep(fitted(NOTHING, initial, self.limits.usual, self.limits, self.catalogue))
        return self.visited[NOTHING]

    def _best_addition(self, current: Hypothesis) -> Hypothesis | None:
        starts, view = self._scores(current, [name for name in self._open(current) if name not in current.effects])
        self._learn(current, view)
        rough = concurrently(lambda name: self._added(current, name, starts[name]), list(starts))
        found = [each for each in rough if each is not None] + self._from_other_starts(current)
        found.sort(key=lambda each: each.score)
        most = FINISHED if current.effects else STARTS
        near = [each for each in found[:most] if self._may_be_best(each, found[0], current)]
        near = list({each.effects: each for each in reversed(near)}.values())  # of one set the best
        finished = concurrently(lambda each: self.finish(each, current), near)
        if any(_is_event_of_load(name) for each in near for name in each.effects - current.effects):
            finished += [self._with_grade(current)] if GRADE in self.names and GRADE not in current.effects else []
        return self._better(finished, current)

    def _may_be_best(self, each: Hypothesis, best: Hypothesis, current: Hypothesis) -> bool:
        """Tell whether a fit of a few steps may end as the best: near it, or an event whose moments are not found."""
        is_event = any(EFFECTS[name].event for name in each.effects - current.effects)
        return each.score <= best.score + NEARLY * _gain(best, current) or (is_event and not current.effects)

    def _from_other_starts(self, current: Hypothesis) -> list[Hypothesis]:
        """Fit a hypothesis' effects from other starts a few steps, once for each set of other effects.

        Laws are written other ways, events looked for in other stretches of the recordings.
        """
        fits: list[Hypothesis | None] = []
        for name in sorted(current.effects - {GRADE} - self._restarted[current.effects]):
            self._restarted[current.effects].add(name)
            fits += self._rewritten(current, name)
            if EFFECTS[name].event:
                fits.append(self._elsewhere(current, name))
        return [each for each in fits if each is not None and self.is_plausible(each)]

    def _rewritten(self, current: Hypothesis, name: str) -> list[Hypothesis]:
        """Fit a law written other ways."""
        fits, result = [], current.result
        for other in EFFECTS[name].reparametrised(
            self.model, self.records, result.values_of(name), line_values(result)
        ):
            initial = with_line_values(forgetting(result, name), other.line)
            (release,) = released(name, self.model, self.records, [other.start])
            alone = replace(release, own=((),) * len(self.records))
            problem = self._extended(initial, current.effects, alone)
            started = extended(problem, warm_start(problem, initial), result, anew=name)
            fits.append(self._compared(current.effects, started, current))
        return fits

    def _elsewhere(self, current: Hypothesis, name: str) -> Hypothesis | None:
        """Fit an event where a look at the same hypothesis without it, the rest as it is, sees it."""
        result, effects = current.result, current.effects - {name}
        problem = self._problem(effects, unknowns_of(result, (effects - {GRADE}) | set(self.model.effects)))
        without = extended(problem, warm_start(problem, forgetting(result, name)), result)
        reduced = replace(current, effects=effects, result=replace(without, converged=without.derivative is not None))
        return self._added(reduced, name, self._score(reduced, name), current)

    def _open(self, current: Hypothesis) -> Sequence[str]:
        """Return the testable effects; behind a sensor blind for the sign, reversals are those of the motion."""
        if BLIND not in current.effects and BLIND not in self.model.effects:
            return self.names
        result = current.result
        p = np.array([result.p_of(i) for i in range(len(self.records))])
        p[:, slot(BLIND, "share")] = 0.0
        seeing = [
            replace(record, output=simulate(result.problem.grid, record, mine, start_of(result.problem, result.x, i)))
            for i, (record, mine) in enumerate(zip(self.records, p, strict=True))
        ]
        testable = open_hypotheses(self.model, seeing)[0]
        return list(dict.fromkeys([*self.names, *testable]))

    def _graded(self, current: Hypothesis) -> Hypothesis | None:
        """Return a hypothesis with a load that walks far, which follows whatever is slow: after all laws."""
        if GRADE not in self.names or GRADE in current.effects:
            return None
        return self._better([self._with_grade(current)], current)

    def _better(self, found: Sequence[Hypothesis], current: Hypothesis) -> Hypothesis | None:
        better = [each for each in found if each.score < current.score and self.is_plausible(each)]
        return min(better, key=lambda each: each.score, default=None)

    def _score(self, reduced: Hypothesis, name: str) -> list[ScoredStart]:
        view = CachedScoreTests(reduced, self.model, self.answers)
        starts = promising(view.starts(name))
        self._learn(reduced, view)
        return starts

    def _learn(self, around: Hypothesis, view: CachedScoreTests) -> None:
        self.answers.learn(around.result, view.found)

    def _scores(
        self, current: Hypothesis, names: Sequence[str], rival: str = ""
    ) -> tuple[dict[str, list[ScoredStart]], CachedScoreTests]:
        """Return the starts of the effects that are worth a fit, the most promising effect first.

        With a ``rival`` those are worth it that promise nearly as much.
        """
        view = CachedScoreTests(current, self.model, self.answers)
        contained = {special for have in current.effects for special in EFFECTS[have].contains}
        tried = [name for name in names if name != GRADE and name not in contained]
        starts = dict(zip(tried, concurrently(view.starts, tried), strict=True))
        price = float(np.log(current.result.residual.size))
        if not rival:
            self.foreseen.update({name: current.score - starts[name][0].promise + price for name in tried})
        order = sorted(tried, key=lambda name: -starts[name][0].promise)
        least = max(WORTH_FITTING * starts[order[0]][0].promise, np.log(current.result.residual.size)) if order else 0.0
        if rival and rival != GRADE:
            least = max(least, SAME_PROMISE * view.starts(rival)[0].promise)
        loose = [name for name in order if EFFECTS[name].widens]
        some = 0 if rival else FEWEST_FITS
        worth = [name for i, name in enumerate(order) if starts[name][0].promise >= least or i < some]
        equals = {name: EFFECTS[name].equivalent if current.outputs == 1 else () for name in worth}
        twins = {twin for name in worth for twin in equals[name] if precedes(name, twin)}
        worth = [name for name in worth if name not in twins][:MOST_FITS]
        first = [*loose, *(name for name in COMMON if name in tried)] if not current.effects and not rival else []
        chosen = {name: promising(starts[name]) for name in dict.fromkeys([*worth, *first])}
        return chosen | self._at_known_moments(current, tried, starts, rival, view), view

    def _at_known_moments(
        self,
        current: Hypothesis,
        names: Sequence[str],
        starts: Mapping[str, Sequence[ScoredStart]],
        instead: str,
        view: CachedScoreTests,
    ) -> dict[str, list[ScoredStart]]:
        """Return the starts of the events among some effects at moments that are known, next to those of their own.

        Known are those of the event that one takes the place of; else of the most promising one. What happened once in
        a recording is found once, and each law that may have happened is tried on it.
        """
        events = [name for name in names if EFFECTS[name].event]
        if instead and EFFECTS[instead].event:
            moments = self._moments.get((current.effects, instead))
        else:
            best = max(events, key=lambda name: starts[name][0].promise, default="")
            moments = _moments_of(starts[best][0].release) if best and starts[best][0].promise > 0.0 else None
        if moments is None or not any(begin < end for begin, end in moments):
            return {}
        least = float(np.log(current.result.residual.size))
        handed = {name: view.handed_over(name, moments)[:1] for name in events}
        return {
            name: [*promising(starts[name]), *found]
            for name, found in handed.items()
            if found and found[0].promise > least
        }

    def _added(
        self, current: Hypothesis, name: str, starts: Sequence[ScoredStart], instead: Hypothesis | None = None
    ) -> Hypothesis | None:
        """Fit an effect on top of a hypothesis a few steps, from each of its starts; None where no value is one.

        Where it takes the place of another effect, begun and weighted as the hypothesis with that one: ``instead``. An
        effect that is begun elsewhere is weighted so, too.
        """
        effects = with_effect(current.effects, name)
        is_again = instead is not None and name in instead.effects
        if effects in self.visited and not is_again:
            return self.visited[effects]
        rival = instead or current
        previous = current.result if is_again else rival.result
        for gone in rival.effects - effects - {GRADE}:
            previous = forgetting(previous, gone)
        fits = []
        for scored in starts:
            problem = self._extended(previous, effects, inheriting(name, scored.release, previous))
            initial = extended(problem, warm_start(problem, previous), current.result if is_again else rival.result)
            fits.append(self._compared(effects, initial, rival))
        best = min([each for each in fits if self.is_plausible(each)] or fits, key=lambda each: each.score)
        loose = widened(best, self.model)
        if loose is not None:
            best = self._more_plausible(best, self._compared(effects, loose, rival))
        is_plausible = self.is_plausible(best)
        with self._lock:
            scores = self.rivals if is_plausible else self.implausible
            scores[name] = min(best.score, scores.get(name, math.inf))
            if is_plausible and (effects not in self.rough or best.score < self.rough[effects].score):
                self.rough[effects] = best
        return best if is_plausible else None

    def _compared(self, effects: Effects, initial: FitResult, rival: Hypothesis) -> Hypothesis:
        return compared(effects, initial, rival, self._limits_of(effects), self.catalogue)

    def _limits_of(self, effects: Effects) -> Limits:
        return self.limits.freed() if GRADE in effects else self.limits

    def _with_grade(self, current: Hypothesis) -> Hypothesis:
        effects = current.effects | {GRADE}
        return self.finish(replace(current, effects=effects, limits=self._limits_of(effects)), current)

    def finish(self, rough: Hypothesis, rival: Hypothesis) -> Hypothesis:
        """Take a fit as far as a comparison with a rival needs; kept where it is the best of its set so far."""
        known = self.visited.get(rough.effects)
        if known is None or rough.score < known.score:
            whole = self._fitted(rough, rough.result, rival)
            loose = widened(whole, self.model)
            if loose is not None:
                whole = self._more_plausible(whole, self._fitted(whole, loose, rival))
            whole = whole if self.is_plausible(whole) else rough
            if known is None or whole.score < known.score:
                self._keep(whole)
        return self.visited[rough.effects]

    def _fitted(self, of: Hypothesis, initial: FitResult, rival: Hypothesis) -> Hypothesis:
        return fitted(of.effects, initial, of.sizes, of.limits, self.catalogue, rival.minus_twice_log)

    def _more_plausible(self, one: Hypothesis, other: Hypothesis) -> Hypothesis:
        """Return the better of two fits of a set, where both are plausible; else the one that is."""
        return other if self.is_plausible(other) and (other.score < one.score or not self.is_plausible(one)) else one

    def is_plausible(self, hypothesis: Hypothesis) -> bool:
        """Tell whether the values of every effect are a case of it."""
        return is_plausible(hypothesis, self.model, self.records)

    def is_resolved(self, hypothesis: Hypothesis, name: str) -> bool:
        """Tell whether an effect is large enough to be distinguished from another way of sampling."""
        values = hypothesis.result.values_of(name)
        return name == GRADE or not EFFECTS[name].unresolved(self.model, self.records, values)

    def without(self, current: Hypothesis, name: str) -> Hypothesis:
        """Fit a hypothesis without one of its effects, the others begun where they are, once from each hypothesis.

        The set may be known: from where it was begun before it may have ended in a poorer optimum.
        """
        effects, place = current.effects - {name}, (current.effects, name)
        known = self.visited.get(effects)
        if known is None or place not in self._lessened:
            self._lessened.add(place)
            result = current.result
            if name != GRADE:
                release = unknowns_of(result, (effects - {GRADE}) | set(self.model.effects))
                problem = self._problem(effects, release)
                result = extended(problem, warm_start(problem, forgetting(result, name)), result)
            limits = self._limits_of(effects)
            found = fitted(effects, result, current.sizes, limits, self.catalogue, current.minus_twice_log)
            if known is None or found.score < known.score:
                self._keep(found)
        return self.visited[effects]

    def exchanged(self, current: Hypothesis, name: str, other: str) -> Hypothesis | None:
        """Fit another effect in the place of one; None where no value is one."""
        reduced = self.without(current, name)
        rough = self._added(reduced, other, self._score(reduced, other), current)
        return None if rough is None else self.finish(rough, current)

    def fit_look_alikes(self, best: Hypothesis) -> None:
        """Fit to their end what came near in the place of an effect, so that each look-alike has its own values."""
        for effects, rough in sorted(self.rough.items(), key=lambda item: sorted(item[0])):
            exchanged = len(effects) == len(best.effects) and len(effects & best.effects) == len(effects) - 1
            if exchanged and effects not in self.visited:
                gone = next(iter(best.effects - effects))
                if rough.score < best.score + NEARLY * _gain(best, self.without(best, gone)):
                    self.finish(rough, best)

    def _best_drop(self, current: Hypothesis) -> Hypothesis | None:
        """Return a set without one of the effects that is more probable, or that simulates as well.

        Fitted anew from there, fewer laws may have found a better optimum than the one that others were added to.
        """
        fewer = concurrently(lambda name: self.without(current, name), sorted(current.effects))
        better = self._better(fewer, current)
        if better is not None or not fewer:
            return better
        whole = self.trials.one(current)
        as_good = [each for each in self.trials.of(fewer) if each.beats(whole) and self.is_plausible(each.hypothesis)]
        return min(as_good, key=lambda each: each.rms).hypothesis if as_good else None

    def _best_exchange(self, current: Hypothesis) -> Hypothesis | None:
        nearest = concurrently(lambda name: self._nearest(current, name), sorted(current.effects))
        for _, reduced, view in nearest:
            self._learn(reduced, view)
        return self._better([each for each, _, _ in nearest if each is not None], current)

    def _nearest(self, current: Hypothesis, name: str) -> tuple[Hypothesis | None, Hypothesis, CachedScoreTests]:
        """Fit the look-alike that explains most in an effect's place to its end; None where none comes near.

        A load that walks far has no law for a first look to judge it by: it is fitted to its end.
        """
        reduced = self.without(current, name)
        alike = [other for other in self.names if other not in current.effects and are_alike(name, other)]
        if name != GRADE and EFFECTS[name].event:
            self._moments[reduced.effects, name] = moments_of(current.result, name)
        starts, view = self._scores(reduced, alike, name)
        rough = [self._added(reduced, other, starts[other], current) for other in starts]
        near = current.score + NEARLY * _gain(current, reduced)
        found = [each for each in rough if each is not None and each.score < near]
        best = [self.finish(min(found, key=lambda each: each.score), current)] if found else []
        if GRADE in alike:
            best.append(self._with_grade(reduced))
        return min(best, key=lambda each: each.score, default=None), reduced, view

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
        return make_problem(
            self.model,
            self.records,
            shared,
            own=release.own,
            use=self.use,
            grid=self.grid or grid_for(self.model, self.records),
        )

    def _keep(self, hypothesis: Hypothesis) -> None:
        self.visited[hypothesis.effects] = hypothesis


def _is_event_of_load(name: str) -> bool:
    """Tell whether an effect is one that a road's grade may be taken for: a load that comes and goes."""
    return EFFECTS[name].event and EFFECTS[name].element is Element.LOAD


def _moments_of(release: Release) -> list[Moments]:
    """Return from when to when an event acts in each recording where a fit of it would start [s since it began]."""
    each = [{unknown.name: unknown.start for unknown in own} for own in release.own]
    return [(own["from_s"], own["to_s"]) for own in each]


def _gain(better: Hypothesis, than: Hypothesis) -> float:
    return max(than.score - better.score, 0.0)


def precedes(one: str, other: str) -> bool:
    """Tell whether an effect comes before another in the catalogue: along the chain from command to sample."""
    order = list(EFFECTS)
    return order.index(one) < order.index(other)


def are_alike(one: str, other: str) -> bool:
    """Tell whether one effect is tried in another's place: a look-alike, a neighbour, or an event for an event."""
    a, b = EFFECTS[one], EFFECTS[other]
    alike_to = {*a.resembles, *a.equivalent}, {*b.resembles, *b.equivalent}
    return other in alike_to[0] or one in alike_to[1] or a.element is b.element or (a.event and b.event)
