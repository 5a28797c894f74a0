"""Candidates for a law without a name: functions of what happens in the line, at every place of the chain.

A law acts as a torque at motor, shaft or load, in the torque path, or as an error of the reading. Each is a function of
the motion that goes with an unknown input at its own place (``line.equivalent``), so that it is taken at
the speed and the twist that were there and not at those of a simulation that lacks it. The answer of the output to it
is that of the linearised line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimator.diagnosis.line import DRIVES, FORCES, PLACES, Line, Place
from estimator.diagnosis.unnamed.forms import Columns, Form, forms
from estimator.diagnosis.unnamed.scene import Scene
from estimator.physics.effect import Element
from estimator.signals.record import FloatArray


@dataclass(frozen=True, slots=True)
class Candidate:
    """A law without a name: q functions with a coefficient each, and the output's answers to them.

    Attributes
    ----------
    law : str
        The function, as text.
    answers : ndarray, shape (rows, q)
        Change of the output per unit of each coefficient, over the blocks in use of all recordings.
    """

    element: Element
    law: str
    answers: FloatArray


def candidates(view: Scene, element: Element, tried: Sequence[Form] | None = None) -> list[Candidate]:
    """Return laws without a name at one element, all by default, with the output's answers to them."""
    return [
        Candidate(element, form.law, answers(view, element, form.build(view.motions(element))))
        for form in (forms(view, element) if tried is None else tried)
    ]


def answers(view: Scene, element: Element, columns: Sequence[Columns]) -> FloatArray:
    """Return the output's answers to functions of time at an element, shape (rows, q), blocks in use only."""
    return np.concatenate(
        [_answers_of(line, element, each)[line.rows] for line, each in zip(view.cut, columns, strict=True)]
    )


def _answers_of(line: Line, element: Element, columns: Columns) -> FloatArray:
    if PLACES[element] is Place.SENSOR:
        return columns
    motor, load = FORCES[PLACES[element]]
    sign = DRIVES[element]
    found = np.zeros_like(columns)
    for i, column in enumerate(columns.T):
        if column.any():
            forced = np.ascontiguousarray(sign * column)
            found[:, i] = line.tangent.answer(motor * forced, load * forced)
    return found
