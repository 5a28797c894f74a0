"""The search over sets of effects: add, drop, exchange, until no change lowers the score."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from estimator.diagnosis.hypotheses import NOTHING, Effects, open_hypotheses, with_effect
from estimator.diagnosis.inference.disturbances import Limits, limits_for
from estimator.diagnosis.inference.likelihood import Hypothesis, compared, fitted
from estimator.diagnosis.inference.looks import screen
from estimator.diagnosis.inherit import forgetting, inheriting, kept
from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.screening import Look, promising
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.grid import Grid, grid_for
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel
from estimator.physics.parallel import concurrently
from estimator.physics.problem import Problem, make_problem, start_of, start_vector
from estimator.physics.simulate import simulate
from estimator.physics.starts import warm_start
from estimator.physics.steps import has_edge
from estimator.physics.torque_path import shaft_torque
from estimator.physics.unknowns import Release, nominal_unknowns, own_unknowns
from estimator.signals.record import BoolArray, Record

BLIND = "speed_sign_blind"
GRADE = "road_grade"
"""The effect that is no law: a load that walks further than any load does by itself."""

MOST_FITS = 6
"""Effects that are fitted on top of a hypothesis, the most promising of a first look."""

WORTH_FITTING = 0.1
"""Share of the best promise below which an effect is not fitted."""

SAME_PROMISE = 0.5
"""Share of what an effect promises that a look-alike must promise in its place."""

NEARLY = 0.3
"""Share of what an effect explains by which a look-alike's first few steps may be behind for it to be fitted."""

LEAST_THROUGH = 0.2
"""Share of the torque's RMS that must get through the torque path: less switches the input off to explain nothing."""

MOST_EFFECTS = 8
FINISHED = 2
"""Best of these that are fitted to their end."""


def never() -> bool:
    """Leave a search all the time it needs."""
    return False


@dataclass
class Search:
    """Hypotheses on a model and recordings; each set of effects is fitted once.

    Attributes
    ----------
    visited : dict of set of effects to Hypothesis
        Those that were fitted to their end.
    rivals : dict of str to float
        Best score of a set with each effect that was fitted at all.
    is_over : callable
        Tells when no further change is to be tried: ``stopped`` says that it was so.
    """

    model: DrivelineModel
    records: Sequence[Record]
    use: Sequence[BoolArray]
    names: Sequence[str]
    grid: Grid | None = None
    visited: dict[Effects, Hypothesis] = field(default_factory=dict)
    rivals: dict[str, float] = field(default_factory=dict)
    is_over: Callable[[], bool] = never
    stopped: bool = False
    _limits: Limits | None = None

    @property
    def limits(self) -> Limits:
        """Usual disturbances of these recordings and their bounds."""
        if self._limits is None:
            self._limits = limits_for(self.records, noise_floor(self.records))
        return self._limits

    def run(self) -> Hypothesis:
        """Return the best set of effects found."""
        current = self.nothing()
        for _ in range(2 * MOST_EFFECTS):
            if self.is_over():
                self.stopped = True
                break
            better = self._best_addition(current) if len(current.effects) < MOST_EFFECTS else None
            better = better or self._best_drop(current) or self._best_exchange(current) or self._graded(current)
            if better is None:
                break
            current = better
        return current

    def nothing(self) -> Hypothesis:
        """Fit the nominal model."""
        if NOTHING not in self.visited:
            own = tuple(own_unknowns(self.model.effects, record) for record in self.records)
            problem = self._problem(NOTHING, Release(nominal_unknowns(self.model), own))
            self._keep(fitted(NOTHING, problem, start_vector(problem), self.limits.usual, self.limits, len(self.names)))
        return self.visited[NOTHING]

    def _best_addition(self, current: Hypothesis) -> Hypothesis | None:
        looks = self._looks(current, [name for name in self._open(current) if name not in current.effects])
        rough = concurrently(lambda name: self._added(current, name, looks[name]), list(looks))
        found = [each for each in rough if each is not None]
        found.sort(key=lambda each: each.score)
        finished = concurrently(lambda each: self.finish(each, current), found[:FINISHED])
        return self._better(finished, current)

    def _open(self, current: Hypothesis) -> Sequence[str]:
        """Return the effects that can be told; behind a sensor blind for the sign reversals are the motion's own."""
        if BLIND not in current.effects and BLIND not in self.model.effects:
            return self.names
        plain = current.plain
        p = np.array([plain.p_of(i) for i in range(len(self.records))])
        p[:, slot(BLIND, "share")] = 0.0
        seeing = [
            replace(record, output=simulate(plain.problem.grid, record, mine, start_of(plain.problem, plain.x, i)))
            for i, (record, mine) in enumerate(zip(self.records, p, strict=True))
        ]
        told = open_hypotheses(self.model, seeing)[0]
        return list(dict.fromkeys([*self.names, *told]))

    def _graded(self, current: Hypothesis) -> Hypothesis | None:
        """Return a hypothesis with a load that walks far, which follows whatever is slow: after all laws."""
        if GRADE not in self.names or GRADE in current.effects:
            return None
        return self._better([self._with_grade(current)], current)

    def _better(self, found: Sequence[Hypothesis], current: Hypothesis) -> Hypothesis | None:
        best = min(found, key=lambda each: each.score, default=None)
        return best if best is not None and best.score < current.score else None

    def _looks(self, current: Hypothesis, names: Sequence[str], rival: str = "") -> dict[str, list[Look]]:
        """Return the starts of the effects that are worth a fit, the most promising effect first.

        Beside a ``rival`` those are worth it that promise nearly as much.
        """
        view = screen(current, self.model)
        contained = {special for have in current.effects for special in EFFECTS[have].contains}
        tried = [name for name in names if name != GRADE and name not in contained]
        looks = dict(zip(tried, concurrently(view.looks, tried), strict=True))
        order = sorted(tried, key=lambda name: -looks[name][0].promise)
        least = max(WORTH_FITTING * looks[order[0]][0].promise, np.log(current.plain.residual.size)) if order else 0.0
        if rival and rival != GRADE:
            least = max(least, SAME_PROMISE * view.looks(rival)[0].promise)
        loose = [name for name in order if EFFECTS[name].loosens]
        worth = [name for name in order if looks[name][0].promise >= least][:MOST_FITS]
        return {
            name: promising(looks[name])
            for name in dict.fromkeys([*worth, *(loose if not current.effects and not rival else [])])
        }

    def _added(self, current: Hypothesis, name: str, looks: Sequence[Look]) -> Hypothesis | None:
        """Fit an effect on top of a hypothesis a few steps, from each of its starts; None where no value is one."""
        effects = with_effect(current.effects, name)
        if effects in self.visited:
            return self.visited[effects]
        fits = []
        for look in looks:
            problem = self._extended(current, effects, inheriting(name, look.release, current.plain))
            x = warm_start(problem, current.plain)
            fits.append(compared(effects, problem, x, current, len(self.names)))
        best = min(fits, key=lambda each: each.score)
        self.rivals[name] = min(best.score, self.rivals.get(name, best.score))
        return best if self._is_plausible(best) else None

    def _limits_of(self, effects: Effects) -> Limits:
        return self.limits.freed() if GRADE in effects else self.limits

    def _with_grade(self, current: Hypothesis) -> Hypothesis:
        effects = current.effects | {GRADE}
        return self.finish(replace(current, effects=effects, limits=self._limits_of(effects)), current)

    def finish(self, rough: Hypothesis, rival: Hypothesis) -> Hypothesis:
        """Take a fit as far as a comparison with a rival needs."""
        if rough.effects not in self.visited:
            plain = rough.plain
            whole = fitted(
                rough.effects, plain.problem, plain.x, rough.sizes, rough.limits, len(self.names), rival.minus_twice_log
            )
            self._keep(whole if self._is_plausible(whole) else rough)
        return self.visited[rough.effects]

    def _is_plausible(self, hypothesis: Hypothesis) -> bool:
        """Tell whether the values of every effect are a case of it."""
        plain = hypothesis.plain
        values = {name: plain.values_of(name) for name in hypothesis.effects - {GRADE}}
        if any(EFFECTS[name].implausible(self.model, self.records, values[name]) for name in values):
            return False
        edges = all(has_edge(name, plain) for name in values if EFFECTS[name].event)
        return edges and self._is_driven(plain) and not self._is_stuck(values)

    def _is_driven(self, plain: FitResult) -> bool:
        """Tell whether the torque path lets a real part of the torque through in every recording."""
        for i, record in enumerate(self.records):
            torque = shaft_torque(record.torque_nm, record.time_s - record.time_s[0], plain.p_of(i))
            if float(torque @ torque) < LEAST_THROUGH**2 * float(record.total_torque_nm @ record.total_torque_nm):
                return False
        return True

    def _is_stuck(self, values: Mapping[str, Mapping[str, float]]) -> bool:
        """Tell whether a torque against the motion is above all torque that was applied."""
        most = max(float(np.abs(record.total_torque_nm).max()) for record in self.records)
        return any(
            values[name].get(parameter.name, 0.0) > most
            for name in values
            if EFFECTS[name].element in (Element.MOTOR, Element.LOAD)
            for parameter in EFFECTS[name].parameters
            if parameter.dimension == "torque"
        )

    def is_resolved(self, hypothesis: Hypothesis, name: str) -> bool:
        """Tell whether an effect is large enough to be told from another way of sampling."""
        values = hypothesis.plain.values_of(name)
        return name == GRADE or not EFFECTS[name].unresolved(self.model, self.records, values)

    def without(self, current: Hypothesis, name: str) -> Hypothesis:
        """Fit a hypothesis without one of its effects, the others begun where they are."""
        effects = current.effects - {name}
        if effects not in self.visited:
            plain = current.plain
            if name != GRADE:
                release = kept(plain, (effects - {GRADE}) | set(self.model.effects))
                problem = self._problem(effects, release)
                plain = forgetting(plain, name)
                x = warm_start(problem, plain)
            else:
                problem, x = plain.problem, plain.x
            limits = self._limits_of(effects)
            self._keep(fitted(effects, problem, x, current.sizes, limits, len(self.names), current.minus_twice_log))
        return self.visited[effects]

    def exchanged(self, current: Hypothesis, name: str, other: str) -> Hypothesis | None:
        """Fit another effect in the place of one; None where no value is one."""
        base = self.without(current, name)
        rough = self._added(base, other, promising(screen(base, self.model).looks(other)))
        return None if rough is None else self.finish(rough, current)

    def _best_drop(self, current: Hypothesis) -> Hypothesis | None:
        """Return a hypothesis without an effect that others made superfluous; None where there is none."""
        return self._better(concurrently(lambda name: self.without(current, name), sorted(current.effects)), current)

    def _best_exchange(self, current: Hypothesis) -> Hypothesis | None:
        """Return the best hypothesis with a look-alike in the place of one effect; None where none is better."""
        nearest = concurrently(lambda name: self._nearest(current, name), sorted(current.effects))
        return self._better([each for each in nearest if each is not None], current)

    def _nearest(self, current: Hypothesis, name: str) -> Hypothesis | None:
        """Fit the look-alike that explains most in an effect's place to its end; None where none comes near."""
        base = self.without(current, name)
        alike = [other for other in self.names if other not in current.effects and are_alike(name, other)]
        looks = self._looks(base, alike, name)
        rough = [self._added(base, other, looks[other]) for other in looks]
        near = current.score + NEARLY * max(base.score - current.score, 0.0)
        found = [each for each in rough if each is not None and each.score < near]
        return self.finish(min(found, key=lambda each: each.score), current) if found else None

    def _extended(self, current: Hypothesis, effects: Effects, release: Release) -> Problem:
        common = kept(current.plain, (effects - {GRADE}) | set(self.model.effects))
        own = tuple((*old, *mine) for old, mine in zip(common.own, release.own, strict=True))
        return self._problem(effects, Release((*common.shared, *release.shared), own))

    def _problem(self, effects: Effects, release: Release) -> Problem:
        return make_problem(
            self.model,
            self.records,
            release.shared,
            own=release.own,
            use=self.use,
            grid=self.grid or grid_for(self.model, self.records),
        )

    def _keep(self, hypothesis: Hypothesis) -> None:
        self.visited[hypothesis.effects] = hypothesis


def are_alike(one: str, other: str) -> bool:
    """Tell whether two effects are known to resemble each other, or act at one element."""
    a, b = EFFECTS[one], EFFECTS[other]
    kin = {*a.resembles, *a.equivalent}, {*b.resembles, *b.equivalent}
    return other in kin[0] or one in kin[1] or a.element is b.element
