"""The search for a law at one element: its state, the first look, and further looks from where the law has led."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from scipy import stats
from scipy.ndimage import maximum_filter1d, median_filter

from estimator.diagnosis.line.blocks import PLACES, InputPlace, block_mean_of, lines, simulated
from estimator.diagnosis.noise import SMALLEST_P
from estimator.diagnosis.result import RankedLaw
from estimator.diagnosis.unnamed.forms import (
    MOST_COEFFICIENTS,
    Form,
    Path,
    answers,
    candidates,
    factored,
    forms,
    pursue,
)
from estimator.diagnosis.unnamed.laws import Law
from estimator.diagnosis.unnamed.scene import Extra, Ground, Scene, elements, extra_of, ground_of
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import STEP
from estimator.physics.least_squares import least_inside, unbounded_first
from estimator.physics.parallel import concurrently, in_turn
from estimator.physics.problem import bounds, own_part, residual_at
from estimator.signals.correlation import effective_samples
from estimator.signals.record import BoolArray, FloatArray

RIDGE = 1e-5  # keeps columns that are combinations of others small; a share of a column's norm

MOST_FORCE = 0.8
"""Largest RMS of a law, in RMS of the torque (or reading) in use: a law that takes more than the line carries is no
small thing left out but a way to cancel what is there."""

NEIGHBOURS = 7  # a reading is held against the median of so many around it: a swing of the line lasts longer
FALSE_ALARM = 0.01  # probability that normal noise makes one outlier in all recordings

WITHIN = 0.9
"""Share of the values from which their spread is estimated: few are their neighbours' median, none an outlier."""

MOST_FORMS = 40  # forms that by themselves explain most, which further rounds choose from

STEPS = (1.0, 0.5, 0.2, 0.05)  # shares of a step that are tried until the error falls

ROUNDS = 20  # rounds that locate, at most: the first promises, the others try what it promised

LEAST_ROUNDS = 5
WORTH_A_ROUND = 0.005
"""Rounds that are made in any case, and the share of the squared error that a further one must have taken away at an
element for its next: where the line's own parameters are far off, as next to a shaft that relaxes, law and line come to
each other in many steps."""

MOST_AT_ONCE = 20_000
"""Samples up to which several searches are made at a time: functions and answers take some 4 kB a sample each."""

IN_REACH = 3.0
"""Elements whose law leaves more than this many times the RMS of the best are not looked at again."""


@dataclass(frozen=True, slots=True)
class ScoredLaw:
    """A law and what it costs."""

    terms: tuple[tuple[str, float], ...]
    coefficients: int
    choices: float  # logarithm of the number of laws it was chosen among

    def information(self, before: float, after: float, n: float) -> float:
        """Return what the law gains in BIC, its choice paid for."""
        return n * math.log(before / after) - self.coefficients * math.log(n) - 2.0 * self.choices


NO_LAW = ScoredLaw((), 0, 0.0)


@dataclass(frozen=True, slots=True)
class ElementSearch:
    """The state of the search at one element."""

    element: Element
    view: Scene  # where it looks from, and what re-tuning could explain there
    ground: Ground
    pool: int  # how many forms were tried
    forms: list[Form]  # those that further rounds choose from
    path: Path
    weights: list[FloatArray]  # (B,): the law that ``view`` is simulated with, per recording
    law: ScoredLaw  # that law
    mean_square: float  # what it leaves of the error
    errors: list[FloatArray]  # that error, per recording
    stuck: bool  # true where no step made the simulation better
    rounds: int = 1  # how many the search at all elements has behind it


def worthwhile(state: ElementSearch) -> int:
    """Return how many terms of a path are worth their coefficients and take no more force than the line has."""
    path, ground = state.path, state.ground
    _, left = path.solved(len(path.chosen), RIDGE)
    n = effective_samples(ground.split(left))
    best, terms = 0.0, 0
    for count in range(1, len(path.chosen) + 1):
        gained = cost(state, count).information(path.squares[0], path.squares[count], n)
        if gained <= best:
            continue
        coefficients = path.weighed(count, RIDGE)
        if rms(weights_of(state, count, coefficients)) <= MOST_FORCE * _in_use(state):
            best, terms = gained, count
    return terms


def cost(state: ElementSearch, terms: int, named: tuple[tuple[str, float], ...] = ()) -> ScoredLaw:
    return ScoredLaw(named, state.path.coefficients[terms], terms * math.log(state.pool))


def weights_of(state: ElementSearch, terms: int, coefficients: FloatArray) -> list[FloatArray]:
    """Return the first terms of a path as one function of time per recording, shape (B,)."""
    motions = state.view.motions(state.element)
    built = [state.forms[i].build(motions) for i in state.path.chosen[:terms]]
    return [np.hstack([form[i] for form in built]) @ coefficients for i in range(len(motions))]


def terms_of(state: ElementSearch, terms: int, coefficients: FloatArray) -> tuple[tuple[str, float], ...]:
    """Return the first terms of a path by name, with their coefficients; see ``ScoredLaw``."""
    motions = state.view.motions(state.element)
    term = state.path.term[state.path.term < terms]
    found = []
    for i, each in enumerate(state.path.chosen[:terms]):
        mine = coefficients[term == i]
        form = state.forms[each]
        value = float(mine[0]) if mine.size == 1 else float(np.std(np.vstack(form.build(motions)) @ mine))
        found.append((form.law, value))
    return tuple(found)


def _in_use(state: ElementSearch) -> float:
    at_sensor = PLACES[state.element] is InputPlace.SENSOR
    return rms([line.reading.speed if at_sensor else line.motion.torque for line in state.view.cut])


def rms(parts: Sequence[FloatArray]) -> float:
    """Return the RMS over all recordings."""
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))


def outliers(errors: Sequence[FloatArray]) -> list[BoolArray]:
    """Tell which values of an error stand out of their neighbours, per recording; shapes (B_i,)."""
    distance = [distance_from_neighbours(error) for error in errors]
    every = np.concatenate(distance)
    sigma = float(np.quantile(np.abs(every), WITHIN)) / float(stats.norm.isf(0.5 * (1.0 - WITHIN)))
    limit = float(stats.norm.isf(0.5 * FALSE_ALARM / every.size)) * sigma
    return [np.abs(each) > limit for each in distance]


def distance_from_neighbours(error: FloatArray) -> FloatArray:
    distance: FloatArray = error - median_filter(error, NEIGHBOURS, mode="nearest")
    ends = NEIGHBOURS // 2
    distance[:ends] = distance[-ends:] = 0.0
    return distance


def near(off: BoolArray) -> BoolArray:
    """Tell which values stand next to one that is off, shape (B,): a filter answers to it for some samples."""
    return maximum_filter1d(off.astype(np.int8), NEIGHBOURS, mode="constant").astype(np.bool_)


PARAMETER_LAWS: Mapping[str, tuple[Element, Law]] = {
    "J_M": (Element.MOTOR, lambda m: np.gradient(m.speed, m.time_s)),
    "b_M": (Element.MOTOR, lambda m: m.speed),
    "k": (Element.SHAFT, lambda m: m.twist),
    "c": (Element.SHAFT, lambda m: m.speed - m.load_speed),
    "J_L": (Element.LOAD, lambda m: np.gradient(m.load_speed, m.time_s)),
    "b_L": (Element.LOAD, lambda m: m.load_speed),
}
"""What one unit more of a nominal parameter does, as a law at its place."""


def first(view: Scene, ground: Ground, element: Element) -> ElementSearch:
    """Look for a law at an element from a fit alone; ``ground`` is that of the view."""
    return _from(view, element, ground)


def first_along_motion(view: Scene, reduced_ground: Ground, element: Element) -> ElementSearch:
    inputs = view.explanations[PLACES[element]].inputs
    cut = tuple(replace(line, motion=each.motion) for line, each in zip(view.cut, inputs, strict=True))
    along = replace(view, cut=cut)
    jacobian = reduced_ground.jacobian.copy()
    for j, unknown in enumerate(view.result.problem.shared):
        place = PARAMETER_LAWS.get(unknown.name) if not unknown.effect else None
        if place is not None:
            columns = [place[1](m)[:, np.newaxis] for m in along.motions(element)]
            jacobian[:, j] = unknown.scale * answers(along, place[0], [columns])[0]
    ground = Ground(cut, jacobian, reduced_ground.raw, view.result.pinned)
    return _from(along, element, ground)


def _from(view: Scene, element: Element, ground: Ground) -> ElementSearch:
    tried = forms(view, element)
    path = pursue(candidates(view, element, tried), ground)
    strongest = np.argsort(-path.alone)[:MOST_FORMS].tolist()
    kept = list(dict.fromkeys([*path.chosen, *strongest]))
    path = replace(path, chosen=list(range(len(path.chosen))))
    chosen = [tried[i] for i in kept]
    weights = [np.zeros(line.size) for line in view.cut]
    start = ElementSearch(element, view, ground, len(tried), chosen, path, weights, NO_LAW, 0.0, [], False)
    terms = worthwhile(start)
    coefficients, left = path.solved(terms, RIDGE)
    law = cost(start, terms, terms_of(start, terms, coefficients))
    state = replace(start, law=law, mean_square=float(left @ left) / left.size, errors=ground.split(left))
    return _without_outliers(state) if element is Element.ACQUISITION else state


def _without_outliers(state: ElementSearch) -> ElementSearch:
    """Take single readings that are off for the law, where that is worth a coefficient each."""
    errors = state.ground.split(state.ground.error)
    off = [seen & near(read) for seen, read in zip(outliers(errors), outliers(state.view.as_read), strict=True)]
    count = sum(int(each.sum()) for each in off)
    rest = [np.where(each, 0.0, error) for each, error in zip(off, errors, strict=True)]
    rows = state.ground.error.size
    before, after = state.path.squares[0], sum(float(each @ each) for each in rest)
    aside = [distance_from_neighbours(each) for each in rest]
    n = effective_samples(aside)
    law = ScoredLaw((), count, count * math.log(rows))
    known = state.law.information(before, state.mean_square * rows, n)
    if count == 0 or law.information(before, after, n) <= max(0.0, known):
        return state
    size = rms([error[each] for each, error in zip(off, errors, strict=True)])
    law = replace(law, terms=(("the single readings that are off", size),))
    return replace(state, law=law, mean_square=after / rows, errors=aside, stuck=True)


def again(state: ElementSearch) -> ElementSearch:
    """Simulate with the law found, look at the error from there, and choose again."""
    if state.stuck:
        return state
    terms = worthwhile(state)
    if terms == 0:
        return _given_up(state)
    step, coefficients = _solution(state, terms)
    wanted = weights_of(state, terms, coefficients)
    before = state.view.result
    for share in STEPS:
        weights = [old + share * (new - old) for old, new in zip(state.weights, wanted, strict=True)]
        x = np.clip(before.x + share * step, *bounds(before.problem))
        extra = extra_of(state.view, state.element, weights)
        moved = replace(before, x=x, outputs=tuple(extra.outputs(before, [x], i)[0] for i in range(len(weights))))
        if _squares(state.view, moved) < _squares(state.view, before):
            return _looked(state, moved, extra, weights, cost(state, terms, terms_of(state, terms, coefficients)))
    return _given_up(state)


def _given_up(state: ElementSearch) -> ElementSearch:
    """Return a state that goes no further; a law that was only promised, and not simulated, is none."""
    if any(w.any() for w in state.weights):
        return replace(state, stuck=True)
    errors = state.view.errors
    return replace(state, stuck=True, law=NO_LAW, mean_square=_mean_square(errors), errors=errors)


def without_law(state: ElementSearch) -> FitResult:
    result = state.view.result
    outputs = tuple(simulated(result, i) for i in range(len(state.view.cut)))
    return replace(result, outputs=outputs)


def _looked(
    state: ElementSearch, moved: FitResult, extra: Extra, weights: list[FloatArray], law: ScoredLaw
) -> ElementSearch:
    """Look at the error of a simulation with a law, and choose among the forms again."""
    cut = lines(moved, extra.forces, state.view.cut[0].length)  # in which the law found is written
    view = replace(state.view, result=moved, cut=cut)
    known = answers(view, state.element, [[w[:, np.newaxis] for w in weights]])[0]
    errors = view.errors
    ground = Ground(view.cut, _jacobian(view, extra), np.concatenate(errors) + known, moved.pinned)
    path = pursue(candidates(view, state.element, state.forms), ground)
    return replace(
        state,
        view=view,
        ground=ground,
        path=path,
        weights=weights,
        law=law,
        mean_square=_mean_square(errors),
        errors=errors,
    )


def _mean_square(errors: Sequence[FloatArray]) -> float:
    return sum(float(error @ error) for error in errors) / sum(error.size for error in errors)


def _squares(view: Scene, result: FitResult) -> float:
    if view.filter is None:
        left = residual_at(result.problem, result.outputs)
        return float(left @ left)
    problem = result.problem
    pairs = zip(problem.records, problem.use, result.outputs, strict=True)
    errors = [(record.output - output)[use, np.newaxis] for record, use, output in pairs]
    return sum(float(np.sum(view.filter.part(i, error) ** 2)) for i, error in enumerate(errors))


def _jacobian(view: Scene, extra: Extra) -> FloatArray:
    """Return the derivative of the output by every unknown with a law in place, shape (rows, U)."""
    problem, x = view.result.problem, view.result.x
    _, high = bounds(problem)
    steps = np.where(x + STEP <= high, STEP, -STEP)
    shared = np.arange(len(problem.shared))

    def part(i: int) -> FloatArray:
        mine = np.concatenate([shared, np.arange(x.size)[own_part(problem, i)]])
        points = x + steps[mine, None] * np.eye(x.size)[mine]
        changes = (extra.outputs(view.result, points, i) - view.result.outputs[i]) / steps[mine, None]
        found = np.zeros((view.cut[i].size, x.size))
        for j, change in zip(mine, changes, strict=True):
            found[:, j] = block_mean_of(change, problem.use[i], view.cut[i].length)[0]
        return view.rows(i, found)

    return np.vstack(concurrently(part, range(len(view.cut))))


def _solution(state: ElementSearch, terms: int) -> tuple[FloatArray, FloatArray]:
    """Return the step of the unknowns, inside their bounds, and the coefficients of the first terms."""
    result, ground, path = state.view.result, state.ground, state.path
    columns = path.columns[:, path.term < terms]
    design = np.hstack([ground.jacobian, columns])
    scale = np.maximum(np.linalg.norm(design, axis=0), np.finfo(float).tiny)
    x, (low, high) = result.x, bounds(result.problem)
    below, above = (np.subtract(end, x, out=np.zeros(x.size), where=x != end) for end in (low, high))  # a limit of inf
    free, open_edge = np.full(columns.shape[1], np.inf), 1e-12  # an unknown at its bound has no room but must have some
    lower = np.concatenate([np.minimum(below, -open_edge), -free]) * scale
    upper = np.concatenate([np.maximum(above, open_edge), free]) * scale
    order = unbounded_first(lower, upper, np.ones(scale.size, dtype=bool))
    target = np.concatenate([ground.raw, np.zeros(scale.size)])
    r, along = factored(np.vstack([(design / scale)[:, order], RIDGE * np.eye(scale.size)]), target)
    solved = np.empty(scale.size)
    solved[order] = least_inside(r, along, lower[order], upper[order])
    solved /= scale
    return solved[: result.x.size], solved[result.x.size :]


Item = TypeVar("Item")
Result = TypeVar("Result")


def each_of(result: FitResult, search: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Search for laws in what a fit leaves in several ways: on all cores, or in turn where each takes much room."""
    return (concurrently if result.residual.size <= MOST_AT_ONCE else in_turn)(search, items)


def judged(view: Scene, searches: Sequence[ElementSearch]) -> list[RankedLaw]:
    """Return what each state has found, weighed with one number of independent samples."""
    best = min(searches, key=lambda state: state.mean_square)
    n = max(effective_samples(best.errors), best.ground.unknowns + MOST_COEFFICIENTS + 2.0)
    before = sum(float(error @ error) for error in view.errors)
    return [_law(state, n, before / best.ground.error.size) for state in searches]


def searches_at(view: Scene, rounds: int = 1, initial: Sequence[ElementSearch] = ()) -> list[ElementSearch]:
    """Look for a law at every element, and again where it is among the best.

    ``begun`` is what earlier rounds have found in the same fit, where there were any.
    """
    searches = list(initial) or each_of(view.result, partial(first, view, ground_of(view)), elements(view.result))
    behind = max(state.rounds for state in searches)
    if behind < 2 <= rounds:
        searches = each_of(view.result, partial(_tried, view), searches)
    at_rest = set[int]()
    for done in range(max(behind, 2), rounds):
        least = min(state.mean_square for state in searches)
        near = [i for i, h in enumerate(searches) if not h.stuck and h.mean_square <= IN_REACH**2 * least]
        further = [i for i in near if i not in at_rest]
        for i, moved in zip(further, each_of(view.result, again, [searches[i] for i in further]), strict=True):
            had, searches[i] = searches[i].mean_square, moved
            if done + 1 >= LEAST_ROUNDS and moved.mean_square > (1.0 - WORTH_A_ROUND) * had:
                at_rest.add(i)
    return [replace(state, rounds=max(rounds, behind)) for state in searches]


def _tried(view: Scene, initial: ElementSearch) -> ElementSearch:
    """Look again from the fit alone, and along the motion of an unknown input; return what simulates better."""
    starts = [initial]
    if PLACES[initial.element] is not InputPlace.SENSOR:
        starts.append(first_along_motion(view, initial.ground, initial.element))
    return min((again(start) for start in starts), key=lambda state: (state.stuck, state.mean_square))


def _law(state: ElementSearch, n: float, before: float) -> RankedLaw:
    q = state.law.coefficients
    if q == 0:
        return RankedLaw(state.element, (), math.sqrt(before), 0.0, 1.0)
    gained = state.law.information(before, state.mean_square, n)
    rest = max(n - state.ground.unknowns - q, 1.0)
    f_value = max(before / state.mean_square - 1.0, 0.0) * rest / q
    log_p = float(stats.f.logsf(f_value, q, rest)) + state.law.choices
    p_value = max(math.exp(min(log_p, 0.0)), SMALLEST_P)
    return RankedLaw(state.element, state.law.terms, math.sqrt(state.mean_square), gained, p_value)
