"""The look for a law from where the law found has led.

A large mismatch is more than a small disturbance of the re-tuned model. A further round simulates with the law found
and with what it changes of the parameters, looks at the error from there, and chooses anew; a step that does not make
the simulation better is shortened (Gauss-Newton over the model's unknowns and the law's coefficients).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.line import block_mean_of, lines, simulated
from estimator.diagnosis.unnamed.candidates import answers, candidates
from estimator.diagnosis.unnamed.extra import Extra, extra_of
from estimator.diagnosis.unnamed.ground import Ground
from estimator.diagnosis.unnamed.hunt import NO_LAW, RIDGE, Found, Hunt, cost, terms_of, weights_of, worthwhile
from estimator.diagnosis.unnamed.pursuit import factored, pursue
from estimator.diagnosis.unnamed.scene import Scene
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import STEP
from estimator.physics.least_squares import least_inside, unbounded_first
from estimator.physics.parallel import concurrently
from estimator.physics.problem import bounds, own_part, residual_at
from estimator.signals.record import FloatArray

STEPS = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried until the error falls."""


def again(hunt: Hunt) -> Hunt:
    """Simulate with the law found, look at the error from there, and choose again."""
    if hunt.stuck:
        return hunt
    terms = worthwhile(hunt)
    if terms == 0:
        return _given_up(hunt)
    step, coefficients = _solution(hunt, terms)
    wanted = weights_of(hunt, terms, coefficients)
    before = hunt.view.result
    for share in STEPS:
        weights = [old + share * (new - old) for old, new in zip(hunt.weights, wanted, strict=True)]
        x = np.clip(before.x + share * step, *bounds(before.problem))
        extra = extra_of(hunt.view, hunt.element, weights)
        moved = replace(before, x=x, outputs=tuple(extra.outputs(before, [x], i)[0] for i in range(len(weights))))
        if _squares(hunt.view, moved) < _squares(hunt.view, before):
            return _looked(hunt, moved, extra, weights, cost(hunt, terms, terms_of(hunt, terms, coefficients)))
    return _given_up(hunt)


def _given_up(hunt: Hunt) -> Hunt:
    """Return a hunt that goes no further; a law that was only promised, and not simulated, is none."""
    if any(w.any() for w in hunt.weights):
        return replace(hunt, stuck=True)
    errors = hunt.view.errors
    return replace(hunt, stuck=True, law=NO_LAW, mean_square=_mean_square(errors), errors=errors)


def without_law(hunt: Hunt) -> FitResult:
    """Return the model that a hunt has come to, simulated without its law."""
    result = hunt.view.result
    outputs = tuple(simulated(result, i) for i in range(len(hunt.view.cut)))
    return replace(result, outputs=outputs)


def _looked(hunt: Hunt, moved: FitResult, extra: Extra, weights: list[FloatArray], law: Found) -> Hunt:
    """Look at the error of a simulation with a law, and choose among the forms again."""
    cut = lines(moved, extra.forces, hunt.view.cut[0].length)  # in which the law found is written
    view = replace(hunt.view, result=moved, cut=cut)
    known = answers(view, hunt.element, [[w[:, np.newaxis] for w in weights]])[0]
    errors = view.errors
    ground = Ground(view.cut, _jacobian(view, extra), np.concatenate(errors) + known, moved.pinned)
    path = pursue(candidates(view, hunt.element, hunt.forms), ground)
    return replace(
        hunt,
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
    """Return the sum of squares of the error of simulated outputs, whitened where the view is."""
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


def _solution(hunt: Hunt, terms: int) -> tuple[FloatArray, FloatArray]:
    """Return the step of the unknowns, inside their bounds, and the coefficients of the first terms."""
    result, ground, path = hunt.view.result, hunt.ground, hunt.path
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
