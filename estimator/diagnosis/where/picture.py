"""A law over its data: what the recordings ask for where it acts, over the signal that it is a function of.

The model without the law is held against the recordings, and the input that explains the difference is estimated at the
law's place. That estimate knows nothing of the law. The law is seen through the same estimator: the difference between
the simulations with and without it takes the recordings' place. Both are averaged over bins of the signal; each pass of
the signal through a bin counts as one observation, because neighbouring samples are not independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimator.diagnosis.line import DRIVES, PLACES, Line, Motion, block_mean_of, explain, lines, size_at, smooth
from estimator.diagnosis.result import LawPicture
from estimator.diagnosis.where.axes import AXES, input_unit, signal_unit
from estimator.diagnosis.where.bins import binned_by_pass
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Motion as Kind
from estimator.signals.record import FloatArray

FUNCTION = 0.5
"""Share of a law's power that must be a function of one signal to be drawn over it."""


def picture(
    name: str,
    element: Element,
    without: FitResult,
    outputs: Sequence[FloatArray],
    motions: Sequence[Motion],
    floor: float,
    kind: Kind,
    length: int,
) -> LawPicture | None:
    """Return a law over the signal that it is most nearly a function of; None where it is a function of none.

    Parameters
    ----------
    without : FitResult
        The model without the law, its outputs simulated.
    outputs : sequence of ndarray, shape (N_i,)
        Simulations with the law.
    motions : sequence of Motion
        What then happens, per block.
    length : int
        Samples of such a block.
    """
    cut = lines(without, length=length)
    place = PLACES[element]
    found = explain(without, cut, place, floor)
    size = size_at(without, place)
    sign = DRIVES.get(element, 1.0)
    data = [sign * each.value for each in found.inputs]
    difference = [_as_error(line, outputs[i] - without.outputs[i]) for i, line in enumerate(cut)]
    law = [sign * smooth(line, place, found.rate, size, floor).value for line in difference]
    okay = [line.okay for line in cut]
    best: LawPicture | None = None
    for axis in AXES[element]:
        x = [axis.values(motion, without) for motion in motions]
        binned = binned_by_pass(x, data, law, okay)
        if binned is not None and (best is None or binned.explained > best.explained + 1e-9):
            labels = (name, element, axis.name, signal_unit(axis.dimension, kind), input_unit(place, without, kind))
            best = LawPicture(*labels, *binned.arrays, binned.explained)
    return best if best is not None and best.explained >= FUNCTION else None


def _as_error(line: Line, difference: FloatArray) -> Line:
    """Return a line whose error is a difference of simulations."""
    good = np.ones(difference.size, dtype=np.bool_)
    return replace(line, error=block_mean_of(difference, good, line.length)[0])
