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
from estimator.physics.parallel import concurrently
from estimator.signals.record import FloatArray, IntArray

BATCH = 2**18
"""Values of functions of time that are built and answered at once: enough for compiled code, and no more room."""


@dataclass(frozen=True, slots=True)
class Pool:
    """Laws without a name at one element: functions with a coefficient each, and the output's answers to them.

    Attributes
    ----------
    laws : tuple of str
        The laws, as text.
    group : ndarray of int, shape (width,)
        To which law each function belongs, in order.
    answers : ndarray, shape (width, rows)
        Change of the output per unit of each coefficient, over the blocks in use of all recordings.
    """

    laws: tuple[str, ...]
    group: IntArray
    answers: FloatArray

    def of(self, laws: Sequence[int]) -> FloatArray:
        """Return the answers to some of the laws, in their order, shape (rows, q)."""
        rows = [np.flatnonzero(self.group == law) for law in laws]
        found: FloatArray = self.answers[np.concatenate([np.zeros(0, dtype=int), *rows])].T
        return found


def candidates(view: Scene, element: Element, tried: Sequence[Form] | None = None) -> Pool:
    """Return laws without a name at one element, all by default, with the output's answers to them."""
    tried = forms(view, element) if tried is None else tried
    motions = view.motions(element)
    widths, parts, some = [], list[FloatArray](), list[Sequence[Columns]]()
    room = BATCH
    for form in tried:
        some.append(form.build(motions))
        widths.append(some[-1][0].shape[1])
        room -= sum(columns.size for columns in some[-1])
        if room <= 0:
            parts.append(answers(view, element, some))
            some, room = [], BATCH
    parts.append(answers(view, element, some))
    return Pool(tuple(form.law for form in tried), np.repeat(np.arange(len(widths)), widths), np.vstack(parts))


def answers(view: Scene, element: Element, laws: Sequence[Sequence[Columns]]) -> FloatArray:
    """Return the output's answers to functions of time at an element, shape (width, rows), blocks in use only.

    ``laws`` are any number of laws: of each its functions of time in every recording.
    """
    if not laws:
        return np.zeros((0, sum(int(line.rows.sum()) for line in view.cut)))

    def part(i: int) -> FloatArray:
        functions = np.concatenate([columns[i].T for columns in laws])
        return view.rows(i, _answers_of(view.cut[i], element, functions).T).T

    return np.hstack(concurrently(part, range(len(view.cut))))


def _answers_of(line: Line, element: Element, functions: FloatArray) -> FloatArray:
    """Return the output's answers to functions of time in one recording, a row each."""
    if PLACES[element] is Place.SENSOR:
        return functions
    motor, load = FORCES[PLACES[element]]
    sign = DRIVES[element]
    return line.tangent.answers(sign * motor, sign * load, functions)
