"""The first look for a law at one element: what the error of the re-tuned model promises."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from estimator.diagnosis.line import PLACES
from estimator.diagnosis.unnamed.candidates import answers, candidates
from estimator.diagnosis.unnamed.forms import forms
from estimator.diagnosis.unnamed.ground import Ground
from estimator.diagnosis.unnamed.hunt import NO_LAW, RIDGE, Found, Hunt, cost, rms, terms_of, worthwhile
from estimator.diagnosis.unnamed.laws import Law
from estimator.diagnosis.unnamed.pursuit import pursue
from estimator.diagnosis.unnamed.scene import Scene
from estimator.diagnosis.unnamed.strays import apart_from_neighbours, near, strays
from estimator.physics.effect import Element
from estimator.signals.correlation import effective_samples

KEPT = 40
"""Forms that by themselves explain most, which further rounds choose from."""

PARAMETER_LAWS: Mapping[str, tuple[Element, Law]] = {
    "J_M": (Element.MOTOR, lambda m: np.gradient(m.speed, m.time_s)),
    "b_M": (Element.MOTOR, lambda m: m.speed),
    "k": (Element.SHAFT, lambda m: m.twist),
    "c": (Element.SHAFT, lambda m: m.speed - m.load_speed),
    "J_L": (Element.LOAD, lambda m: np.gradient(m.load_speed, m.time_s)),
    "b_L": (Element.LOAD, lambda m: m.load_speed),
}
"""What one unit more of a nominal parameter does, as a law at its place."""


def first(view: Scene, ground: Ground, element: Element) -> Hunt:
    """Look for a law at an element from a fit alone; ``ground`` is that of the view."""
    return _from(view, element, ground)


def first_along_motion(view: Scene, plain: Ground, element: Element) -> Hunt:
    """Look for a law as a function of the motion that goes with an unknown input at the element's place.

    Along the true motion the line with other parameters and a law is the line as it is under further torques, exactly,
    however large they are: a better start for a large mismatch. The motion holds some of the error, and a law may copy
    it from there; whether it is one shows when it is simulated.
    """
    inputs = view.explanations[PLACES[element]].inputs
    cut = tuple(replace(line, motion=each.motion) for line, each in zip(view.cut, inputs, strict=True))
    along = replace(view, cut=cut)
    jacobian = plain.jacobian.copy()
    for j, unknown in enumerate(view.result.problem.shared):
        place = PARAMETER_LAWS.get(unknown.name) if not unknown.effect else None
        if place is not None:
            columns = [place[1](m)[:, np.newaxis] for m in along.motions(element)]
            jacobian[:, j] = unknown.scale * answers(along, place[0], [columns])[0]
    ground = Ground(cut, jacobian, plain.raw, view.result.pinned)
    return _from(along, element, ground)


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
    coefficients, left = path.solved(terms, RIDGE)
    law = cost(start, terms, terms_of(start, terms, coefficients))
    hunt = replace(start, law=law, mean_square=float(left @ left) / left.size, errors=ground.split(left))
    return _without_strays(hunt) if element is Element.ACQUISITION else hunt


def _without_strays(hunt: Hunt) -> Hunt:
    """Take single readings that are off for the law, where that is worth a coefficient each.

    They have pulled the fit away from the others: a slow error that is no reason to doubt them. What of the rest stands
    apart from its neighbours tells how many samples are independent. A torque that is missing for a moment stands out
    in the innovations, too, and not in what is read.
    """
    errors = hunt.ground.split(hunt.ground.error)
    off = [seen & near(read) for seen, read in zip(strays(errors), strays(hunt.view.as_read), strict=True)]
    count = sum(int(each.sum()) for each in off)
    rest = [np.where(each, 0.0, error) for each, error in zip(off, errors, strict=True)]
    rows = hunt.ground.error.size
    before, after = hunt.path.squares[0], sum(float(each @ each) for each in rest)
    aside = [apart_from_neighbours(each) for each in rest]
    n = effective_samples(aside)
    law = Found((), count, count * math.log(rows))
    known = hunt.law.information(before, hunt.mean_square * rows, n)
    if count == 0 or law.information(before, after, n) <= max(0.0, known):
        return hunt
    size = rms([error[each] for each, error in zip(off, errors, strict=True)])
    law = replace(law, terms=(("the single readings that are off", size),))
    return replace(hunt, law=law, mean_square=after / rows, errors=aside, stuck=True)
