"""The search for a law at one element: from the re-tuned model, and again from where the law found has led.

A large mismatch is more than a small disturbance of the re-tuned model. A further round simulates with the law found
and with what it changes of the parameters, looks at the error from there, and chooses anew; a step that does not make
the simulation better is shortened (Gauss-Newton over the model's unknowns and the law's coefficients).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from estimator.diagnosis.blocks import NO_FORCE, Force, block_mean_of, lines, simulated
from estimator.diagnosis.disturbances import DRIVES, PLACES, Form, Law, Scene, answers, candidates, forms
from estimator.diagnosis.equivalent import FORCES, Place
from estimator.diagnosis.noise import effective_samples
from estimator.diagnosis.pursuit import Ground, Path, pursue
from estimator.diagnosis.strays import strays
from estimator.physics.effect import Element
from estimator.physics.fit import STEP, FitResult, bounds, residual_at
from estimator.signals.record import FloatArray

KEPT = 40
"""Forms that by themselves explain most, which further rounds choose from."""

STEPS = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried until the error falls."""

RIDGE = 1e-5
"""Keeps columns that are combinations of others small; a share of a column's norm."""

MOST_FORCE = 1.0
"""Largest RMS of a law, in RMS of the torque (or reading) in use: a law that takes more than the line carries is no
small thing left out but a way to cancel what is there."""


@dataclass(frozen=True, slots=True)
class Found:
    """A law and what it costs.

    Attributes
    ----------
    terms : tuple of (str, float)
        Its terms with their coefficients or, of several coefficients, the RMS of what they do.
    coefficients : int
    choices : float
        Logarithm of the number of laws it was chosen among.
    """

    terms: tuple[tuple[str, float], ...]
    coefficients: int
    choices: float

    def information(self, before: float, after: float, n: float) -> float:
        """Return what the law gains in BIC, its choice paid for."""
        return n * math.log(before / after) - self.coefficients * math.log(n) - 2.0 * self.choices


NO_LAW = Found((), 0, 0.0)


@dataclass(frozen=True, slots=True)
class Hunt:
    """The state of the search at one element.

    Attributes
    ----------
    view, ground : Scene, Ground
        Where it looks from, and what re-tuning could explain there.
    pool : int
        How many forms were tried.
    forms : list of Form
        Those that further rounds choose from.
    weights : list of ndarray, shape (B,)
        The law that ``view`` is simulated with, per recording: zero in the first round.
    law : Found
        That law; in the first round the one the path promises.
    mean_square : float
        What it leaves of the error.
    errors : list of ndarray
        That error, per recording.
    stuck : bool
        True where no step made the simulation better.
    """

    element: Element
    view: Scene
    ground: Ground
    pool: int
    forms: list[Form]
    path: Path
    weights: list[FloatArray]
    law: Found
    mean_square: float
    errors: list[FloatArray]
    stuck: bool


def first(view: Scene, element: Element) -> Hunt:
    """Look for a law at an element from a fit alone."""
    return _from(view, element, ground_of(view))


def first_along_motion(view: Scene, element: Element) -> Hunt:
    """Look for a law as a function of the motion that goes with an unknown input at the element's place.

    Along the true motion the line with other parameters and a law is the line as it is under further torques, exactly,
    however large they are: a better start for a large mismatch. The motion holds some of the error, and a law may copy
    it from there; whether it is one shows when it is simulated.
    """
    inputs = view.explanations[PLACES[element]].inputs
    cut = tuple(replace(line, motion=each.motion) for line, each in zip(view.cut, inputs, strict=True))
    along = replace(view, cut=cut)
    plain = ground_of(view)
    jacobian = plain.jacobian.copy()
    for j, unknown in enumerate(view.result.problem.shared):
        place = PARAMETER_LAWS.get(unknown.name) if not unknown.effect else None
        if place is not None:
            columns = [place[1](m)[:, np.newaxis] for m in along.motions(element)]
            jacobian[:, j] = unknown.scale * answers(along, place[0], columns)[:, 0]
    ground = Ground(cut, jacobian, plain.raw, view.result.pinned)
    return _from(along, element, ground)


PARAMETER_LAWS: Mapping[str, tuple[Element, Law]] = {
    "J_M": (Element.MOTOR, lambda m: np.gradient(m.speed, m.time_s)),
    "b_M": (Element.MOTOR, lambda m: m.speed),
    "k": (Element.SHAFT, lambda m: m.twist),
    "c": (Element.SHAFT, lambda m: m.speed - m.load_speed),
    "J_L": (Element.LOAD, lambda m: np.gradient(m.load_speed, m.time_s)),
    "b_L": (Element.LOAD, lambda m: m.load_speed),
}
"""What one unit more of a nominal parameter does, as a law at its place."""


def _from(view: Scene, element: Element, ground: Ground) -> Hunt:
    tried = forms(view, element)
    path = pursue(candidates(view, element, tried), ground)
    strongest = np.argsort(-path.alone)[:KEPT].tolist()
    kept = list(dict.fromkeys([*path.chosen, *strongest]))
    path = replace(path, chosen=list(range(len(path.chosen))))
    chosen = [tried[i] for i in kept]
    weights = [np.zeros(line.size) for line in view.cut]
    start = Hunt(element, view, ground, len(tried), chosen, path, weights, NO_LAW, 0.0, [], False)
    terms = worthwhile(start)
    coefficients, left = path.solved(ground, terms, RIDGE)
    law = _cost(start, terms, _named(start, terms, coefficients))
    hunt = replace(start, law=law, mean_square=float(left @ left) / left.size, errors=ground.split(left))
    return _without_strays(hunt) if element is Element.ACQUISITION else hunt


def _without_strays(hunt: Hunt) -> Hunt:
    """Take single readings that are off for the law, where that is worth a coefficient each."""
    errors = hunt.ground.split(hunt.ground.error)
    off = strays(errors)
    count = sum(int(each.sum()) for each in off)
    rest = [np.where(each, 0.0, error) for each, error in zip(off, errors, strict=True)]
    rows = hunt.ground.error.size
    before, after = hunt.path.squares[0], sum(float(each @ each) for each in rest)
    n = effective_samples(rest)
    law = Found((), count, count * math.log(rows))
    known = hunt.law.information(before, hunt.mean_square * rows, n)
    if count == 0 or law.information(before, after, n) <= max(0.0, known):
        return hunt
    size = _rms([error[each] for each, error in zip(off, errors, strict=True)])
    law = replace(law, terms=(("single readings that are off", size),))
    return replace(hunt, law=law, mean_square=after / rows, errors=rest, stuck=True)


def ground_of(view: Scene) -> Ground:
    """Return what re-tuning a fit further could explain of its error."""
    result = view.result
    row, parts = 0, []
    for line, use in zip(view.cut, result.problem.use, strict=True):
        count, full = int(use.sum()), np.zeros(use.size)
        part = np.empty((int(line.rows.sum()), result.x.size))
        for j in range(result.x.size):
            full[use] = result.jacobian[row : row + count, j]
            part[:, j] = block_mean_of(full, use, line.length)[0][line.rows]
        row += count
        parts.append(part)
    error = np.concatenate([line.error[line.rows] for line in view.cut])
    return Ground(view.cut, np.vstack(parts), error, result.pinned)


def worthwhile(hunt: Hunt) -> int:
    """Return how many terms of a path are worth their coefficients and take no more force than the line has."""
    path, ground = hunt.path, hunt.ground
    _, left = path.solved(ground, len(path.chosen), RIDGE)
    n = effective_samples(ground.split(left))
    best, terms = 0.0, 0
    for count in range(1, len(path.chosen) + 1):
        gained = _cost(hunt, count).information(path.squares[0], path.squares[count], n)
        if gained <= best:
            continue
        coefficients, _ = path.solved(ground, count, RIDGE)
        if _rms(_weights(hunt, count, coefficients)) <= MOST_FORCE * _in_use(hunt):
            best, terms = gained, count
    return terms


def _cost(hunt: Hunt, terms: int, named: tuple[tuple[str, float], ...] = ()) -> Found:
    """Return the law of the first terms of a path, with what it costs."""
    return Found(named, hunt.path.coefficients[terms], terms * math.log(hunt.pool))


def _in_use(hunt: Hunt) -> float:
    at_sensor = PLACES[hunt.element] is Place.SENSOR
    return _rms([line.reading.speed if at_sensor else line.motion.torque for line in hunt.view.cut])


def _rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))


def _weights(hunt: Hunt, terms: int, coefficients: FloatArray) -> list[FloatArray]:
    """Return the first terms of a path as one function of time per recording, shape (B,)."""
    motions = hunt.view.motions(hunt.element)
    built = [hunt.forms[i].build(motions) for i in hunt.path.chosen[:terms]]
    return [np.hstack([form[i] for form in built]) @ coefficients for i in range(len(motions))]


def _named(hunt: Hunt, terms: int, coefficients: FloatArray) -> tuple[tuple[str, float], ...]:
    motions = hunt.view.motions(hunt.element)
    term = hunt.path.term[hunt.path.term < terms]
    found = []
    for i, each in enumerate(hunt.path.chosen[:terms]):
        mine = coefficients[term == i]
        form = hunt.forms[each]
        value = float(mine[0]) if mine.size == 1 else float(np.std(np.vstack(form.build(motions)) @ mine))
        found.append((form.law, value))
    return tuple(found)


def again(hunt: Hunt) -> Hunt:
    """Simulate with the law found, look at the error from there, and choose again."""
    if hunt.stuck:
        return hunt
    terms = worthwhile(hunt)
    if terms == 0:
        return _given_up(hunt)
    step, coefficients = _solution(hunt, terms)
    wanted = _weights(hunt, terms, coefficients)
    before = hunt.view.result
    for share in STEPS:
        weights = [old + share * (new - old) for old, new in zip(hunt.weights, wanted, strict=True)]
        x = np.clip(before.x + share * step, *bounds(before.problem))
        extra = _extra(hunt.view, hunt.element, weights)
        moved = replace(before, x=x, outputs=tuple(extra.output(before, x, i) for i in range(len(weights))))
        if _squares(moved) < _squares(before):
            return _looked(hunt, moved, extra, weights, _cost(hunt, terms, _named(hunt, terms, coefficients)))
    return _given_up(hunt)


def _given_up(hunt: Hunt) -> Hunt:
    """Return a hunt that goes no further; a law that was only promised, and not simulated, is none."""
    if any(w.any() for w in hunt.weights):
        return replace(hunt, stuck=True)
    error = np.concatenate([line.error[line.rows] for line in hunt.view.cut])
    mean_square, errors = float(error @ error) / error.size, hunt.ground.split(error)
    return replace(hunt, stuck=True, law=NO_LAW, mean_square=mean_square, errors=errors)


def without_law(hunt: Hunt) -> FitResult:
    """Return the model that a hunt has come to, simulated without its law."""
    result = hunt.view.result
    outputs = tuple(simulated(result, i) for i in range(len(hunt.view.cut)))
    return replace(result, outputs=outputs)


def _looked(hunt: Hunt, moved: FitResult, extra: Extra, weights: list[FloatArray], law: Found) -> Hunt:
    """Look at the error of a simulation with a law, and choose among the forms again."""
    view = Scene(moved, lines(moved, extra.forces), hunt.view.explanations)
    known = answers(view, hunt.element, [w[:, np.newaxis] for w in weights])[:, 0]
    error = np.concatenate([line.error[line.rows] for line in view.cut])
    ground = Ground(view.cut, _jacobian(view, extra), error + known, moved.pinned)
    path = pursue(candidates(view, hunt.element, hunt.forms), ground)
    return replace(
        hunt,
        view=view,
        ground=ground,
        path=path,
        weights=weights,
        law=law,
        mean_square=float(error @ error) / error.size,
        errors=ground.split(error),
    )


def _squares(result: FitResult) -> float:
    """Return the sum of squares of the error of simulated outputs."""
    left = residual_at(result.problem, result.outputs)
    return float(left @ left)


@dataclass(frozen=True, slots=True)
class Extra:
    """A law's torques and error of the reading over the samples of each recording."""

    forces: list[Force]
    readings: list[FloatArray]

    def output(self, result: FitResult, x: FloatArray, index: int) -> FloatArray:
        """Simulate the output of one recording with the law at unknowns ``x``, shape (N,)."""
        moved: FloatArray = simulated(replace(result, x=x), index, self.forces[index]) + self.readings[index]
        return moved


def _extra(view: Scene, element: Element, weights: Sequence[FloatArray]) -> Extra:
    samples = [line.samples(w) for line, w in zip(view.cut, weights, strict=True)]
    if PLACES[element] is Place.SENSOR:
        return Extra([NO_FORCE] * len(samples), samples)
    motor, load = (DRIVES[element] * force for force in FORCES[PLACES[element]])
    return Extra([(motor * w, load * w) for w in samples], [np.zeros_like(w) for w in samples])


def _jacobian(view: Scene, extra: Extra) -> FloatArray:
    """Return the derivative of the output by every unknown with a law in place, shape (rows, U)."""
    result = view.result
    _, high = bounds(result.problem)
    shared = len(result.problem.shared)
    first_local = shared + np.cumsum([0, *(basis.guess.size for basis in result.problem.local)])
    parts = []
    for i, line in enumerate(view.cut):
        part = np.zeros((int(line.rows.sum()), result.x.size))
        for j in [*range(shared), *range(first_local[i], first_local[i + 1])]:
            x = result.x.copy()
            x[j] += STEP if x[j] + STEP <= high[j] else -STEP
            change = (extra.output(result, x, i) - result.outputs[i]) / (x[j] - result.x[j])
            part[:, j] = block_mean_of(change, result.problem.use[i], line.length)[0][line.rows]
        parts.append(part)
    return np.vstack(parts)


def _solution(hunt: Hunt, terms: int) -> tuple[FloatArray, FloatArray]:
    """Return the step of the unknowns, inside their bounds, and the coefficients of the first terms."""
    result, ground, path = hunt.view.result, hunt.ground, hunt.path
    columns = path.columns[:, path.term < terms]
    design = np.hstack([ground.jacobian, columns])
    scale = np.maximum(np.linalg.norm(design, axis=0), np.finfo(float).tiny)
    q, r = np.linalg.qr(np.vstack([design / scale, RIDGE * np.eye(scale.size)]))
    low, high = bounds(result.problem)
    free, open_edge = np.full(columns.shape[1], np.inf), 1e-12  # an unknown at its bound has no room but must have some
    lower = np.concatenate([np.minimum(low - result.x, -open_edge), -free]) * scale
    upper = np.concatenate([np.maximum(high - result.x, open_edge), free]) * scale
    solved = lsq_linear(r, q[: ground.raw.size].T @ ground.raw, (lower, upper)).x / scale
    return solved[: result.x.size], solved[result.x.size :]
