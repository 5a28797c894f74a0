"""A law over its data: what the recordings ask for where it acts, over the signal that it is a function of.

The model without the law is held against the recordings, and the input that explains the difference is estimated at the
law's place. That estimate knows nothing of the law. The law is seen through the same estimator: the difference between
the simulations with and without it takes the recordings' place. Both are averaged over bins of the signal; each pass of
the signal through a bin counts as one observation, because neighbouring samples are not independent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from estimator.diagnosis.blocks import Line, Motion, block_mean_of, lines
from estimator.diagnosis.disturbances import DRIVES, PLACES
from estimator.diagnosis.equivalent import Place, explain, size_at, smooth
from estimator.diagnosis.result import LawPicture
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.layout import slot
from estimator.physics.model import Motion as Kind
from estimator.physics.model import unit
from estimator.signals.record import BoolArray, FloatArray

BINS = 24
FEWEST_PASSES = 3
"""A bin that the signal passes less often says nothing of its own scatter."""

FUNCTION = 0.5
"""Share of a law's power that must be a function of one signal to be drawn over it."""


@dataclass(frozen=True, slots=True)
class Axis:
    """A signal that a law may be drawn over: its name, the dimension of its unit, and its values."""

    name: str
    dimension: str
    values: Callable[[Motion, FitResult], FloatArray]


def _twist_torque(motion: Motion, result: FitResult) -> FloatArray:
    torque: FloatArray = result.p[slot("", "k")] * motion.twist
    return torque


TORQUE = Axis("torque", "torque", lambda m, _: m.torque)
MOTOR_SPEED = Axis("motor speed", "speed", lambda m, _: m.speed)
LOAD_SPEED = Axis("load speed", "speed", lambda m, _: m.load_speed)
TWIST_TORQUE = Axis("shaft torque k·twist", "torque", _twist_torque)
TWIST_RATE = Axis("twist rate", "speed", lambda m, _: m.speed - m.load_speed)
ACCELERATION = Axis("acceleration", "speed/s", lambda m, _: np.gradient(m.speed, m.time_s))
ANGLE = Axis("motor angle in its turn", "rad", lambda m, _: np.mod(m.angle, 2.0 * np.pi))
TIME = Axis("time", "s", lambda m, _: m.time_s)

AXES: Mapping[Element, tuple[Axis, ...]] = {
    Element.TORQUE_PATH: (TORQUE, MOTOR_SPEED, ANGLE, TIME),
    Element.MOTOR: (MOTOR_SPEED, ACCELERATION, TORQUE, ANGLE, TIME),
    Element.SHAFT: (TWIST_TORQUE, TWIST_RATE, MOTOR_SPEED, ANGLE, TIME),
    Element.LOAD: (LOAD_SPEED, TWIST_TORQUE, TIME),
    Element.SPEED_SENSOR: (MOTOR_SPEED, ACCELERATION, ANGLE, TORQUE, TIME),
    Element.ACQUISITION: (ACCELERATION, TIME),
}


def picture(
    name: str,
    element: Element,
    without: FitResult,
    outputs: Sequence[FloatArray],
    motions: Sequence[Motion],
    floor: float,
    kind: Kind,
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
    """
    cut = lines(without)
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
        binned = _binned(x, data, law, okay)
        if binned is not None and (best is None or binned.explained > best.explained + 1e-9):
            labels = (name, element, axis.name, _unit(axis.dimension, kind), input_unit(place, without, kind))
            best = LawPicture(*labels, *binned.arrays, binned.explained)
    return best if best is not None and best.explained >= FUNCTION else None


def _as_error(line: Line, difference: FloatArray) -> Line:
    """Return a line whose error is a difference of simulations."""
    good = np.ones(difference.size, dtype=np.bool_)
    return replace(line, error=block_mean_of(difference, good, line.length)[0])


def _unit(dimension: str, kind: Kind) -> str:
    return f"{unit('speed', kind)}/s" if dimension == "speed/s" else unit(dimension, kind)


def input_unit(place: Place, result: FitResult, kind: Kind) -> str:
    """Return the unit of an input at a place."""
    if place is not Place.SENSOR:
        return unit("torque", kind)
    names = {"speed": "speed", "position": "angle", "force": "torque"}
    return unit(names[result.problem.records[0].kind.value], kind)


@dataclass(frozen=True, slots=True)
class _Binned:
    arrays: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
    explained: float


def _binned(
    x: Sequence[FloatArray], data: Sequence[FloatArray], law: Sequence[FloatArray], okay: Sequence[BoolArray]
) -> _Binned | None:
    """Average data and law over bins of a signal, pass by pass."""
    every = np.concatenate([each[good] for each, good in zip(x, okay, strict=True)])
    low, high = np.percentile(every, [0.5, 99.5])
    if not high > low:
        return None
    edges = _edges(every, float(low), float(high))
    passes = [
        _passes(np.where(good, np.clip(np.digitize(each, edges) - 1, -1, BINS), -1), (each, value, curve))
        for each, value, curve, good in zip(x, data, law, okay, strict=True)
    ]
    where = np.concatenate([bins for bins, _ in passes])
    means = np.concatenate([values for _, values in passes])
    rows = [means[where == each] for each in range(BINS)]
    rows = [row for row in rows if row.shape[0] >= FEWEST_PASSES]
    if len(rows) < 4:
        return None
    centres, values, curves = (np.array([np.average(r[:, i], weights=r[:, 3]) for r in rows]) for i in range(3))
    spread = np.array([_half_width(r[:, 1]) for r in rows])
    whole = np.concatenate([each[good] for each, good in zip(law, okay, strict=True)])
    left = whole - np.interp(every, centres, curves)
    explained = 1.0 - float(left @ left) / max(float(np.sum((whole - whole.mean()) ** 2)), np.finfo(float).tiny)
    return _Binned((centres, values, values - spread, values + spread, curves), explained)


def _edges(values: FloatArray, low: float, high: float) -> FloatArray:
    """Return bin edges, half as bins of one width would have them and half as bins of one count would."""
    grid = np.linspace(low, high, 20 * BINS + 1)
    counted = np.searchsorted(np.sort(values), grid) / values.size
    share = 0.5 * (grid - low) / (high - low) + 0.5 * (counted - counted[0]) / (counted[-1] - counted[0])
    return np.interp(np.linspace(0.0, 1.0, BINS + 1), share, grid)


def _half_width(values: FloatArray) -> float:
    """Return half the 95 % interval of a mean of passes."""
    count = values.size
    return float(stats.t.isf(0.025, count - 1) * np.std(values, ddof=1) / np.sqrt(count))


def _passes(bins: FloatArray, signals: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the bin of each pass and the signals' means over it with its length, shapes (P,) and (P, 4)."""
    start = np.flatnonzero(np.diff(bins, prepend=bins[0] - 1))
    length = np.diff(np.append(start, bins.size)).astype(float)
    sums = [np.add.reduceat(each, start) / length for each in signals]
    return bins[start], np.stack([*sums, length], axis=1)
