"""Free forms of laws that are there: rivals of a second name at the same element.

Nature's laws are written in other forms than the model's. What the form leaves is taken by a second law at the same
element, at thousands of units of likelihood. So each second name there has a rival: the set without it, and a curve
through knots in the variable of the law that is there already (`estimator.diagnosis.tables`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from estimator.diagnosis.inference.trials import Trial, between_blocks, inside_blocks
from estimator.diagnosis.tables import table_at
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.problem import outputs_at, residual_at

PLACES: Mapping[Element, str] = {
    Element.TORQUE_PATH: "torque",
    Element.MOTOR: "motor_speed",
    Element.SHAFT: "shaft_twist",
    Element.LOAD: "load_speed",
}
"""The variable that a law's curve is over, by the law's element; a reading has none."""


def free_form(without: Trial, name: str) -> Trial | None:
    """Return a set without a name, with a free form of one of its laws at the name's element; None where none has one.

    Of several measured outputs there is none: a curve is fitted to the first.
    """
    element = EFFECTS[name].element
    if element not in PLACES or without.hypothesis.outputs > 1:
        return None
    if all(EFFECTS[other].element is not element for other in without.effects):
        return None
    hypothesis = without.hypothesis
    result = hypothesis.result
    problem = replace(result.problem, use=between_blocks(result.problem.records))
    curve = table_at(replace(hypothesis, result=replace(result, problem=problem)), PLACES[element])
    if curve is None:
        return None
    tuned, x = curve.descent.at(0.0), curve.descent.x(curve.z)
    outputs = outputs_at(tuned, x)
    fit = FitResult(tuned, x, outputs, residual_at(tuned, outputs), None, False)
    squares, samples = inside_blocks(fit)
    return Trial(hypothesis, without.size + 1, fit, squares, samples)
