"""A curve that is fitted: its knots, laid by where the line was, its unknowns, and the shapes it is begun from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.physics.curve import curve_over
from estimator.physics.fit import FitResult
from estimator.physics.layout import OBSERVER, flat_values, slot
from estimator.physics.motion import torque_scale
from estimator.physics.problem import Problem, case_of
from estimator.physics.table_signals import signal_of
from estimator.physics.tables import COUNT, DAMPING, PREFIX, Table
from estimator.physics.unknowns import Shared
from estimator.signals.record import BoolArray, FloatArray

REACH = 1.5  # knots reach to so many times what the re-tuned model reaches
FRACTIONS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of that, where they stand on both sides of zero
EVEN_KNOTS = 7  # knots of a signal of one sign, equally far apart
FEWEST_SAMPLES = 40  # samples between two knots at least

STRAIGHT = {"shaft_twist": "k", "shaft_rate": "c", "motor_speed": "b_M", "load_speed": "b_L"}
"""Parameter of the line that a straight curve at a place does the same as: intervals are those of both together."""

YIELDING, SLIDER = "shaft_yielding", "shaft_hysteresis"
"""A torque over the twist that yields, as a clutch slips: a straight curve and the slider of this effect."""

LEVEL, SUDDEN = 0.7, 10.0  # where its level starts, in the torque in use, and its knee

Masks = tuple[BoolArray, ...]
"""Which samples count, per recording."""


@dataclass(frozen=True)
class Curve:
    """A curve that is fitted: its knots, and the unknowns that a fit of the line gets with it."""

    place: str  # key of ``PLACES``
    knots: FloatArray  # rising [unit of the place]
    base: float  # slope in which those of the curve count [Nm/unit of the place]
    own: float  # slope that the line has without it, in ``base``
    most: tuple[float, float]  # bounds of the slopes, its own among them
    more: tuple[Shared, ...]  # unknowns next to the slopes: a damping of its own, a level at which it yields

    @property
    def name(self) -> str:
        """Name of the law in the model: the prefix of tables and the place."""
        return PREFIX + self.place

    def slope_of(self, p: FloatArray) -> float:
        """Return the slope that a line of these parameters has without the curve; of torque over torque it is 1."""
        return float(p[slot("", STRAIGHT[self.place])]) if self.place in STRAIGHT else 1.0

    @property
    def yields(self) -> bool:
        """Whether the torque has a level at which it yields."""
        return any(each.effect == SLIDER for each in self.more)

    @property
    def pieces(self) -> int:
        """How many slopes it has: as many as values that are not 0."""
        return self.knots.size - 1

    @property
    def zero(self) -> int:
        """The knot whose value is 0: what is constant is the load's."""
        return int(np.argmin(np.abs(self.knots)))

    @cached_property
    def values_of_slopes(self) -> FloatArray:
        """Matrix from slopes, less its own, to the values but that of knot ``zero``; shape (pieces, pieces)."""
        steps = self.base * np.diff(self.knots)
        sums = np.vstack([np.zeros(self.pieces), np.tril(np.ones((self.pieces, self.pieces))) * steps])
        return np.delete(sums - sums[self.zero], self.zero, axis=0)

    def drawn_in(self, signal: FloatArray) -> Curve:
        """Return the curve with knots where a simulation with it was, ``signal`` (N,), and none beyond.

        They are laid before the fit, by a simulation without the curve: with it, a shaft that slips turns on.
        """
        inside = self.knots[(self.knots > signal.min()) & (self.knots < signal.max())]
        anchor = self.knots[self.zero]
        sides = [np.append(-inside[::-1], -signal.min()), np.append(inside, signal.max())]
        down, up = (_outward(sign * anchor, side, sign * signal) for sign, side in zip((-1.0, 1.0), sides, strict=True))
        return replace(self, knots=np.array([*(-each for each in reversed(down)), anchor, *up]))

    def slopes_between(self, knots: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the slopes, shape (K - 1,), of this curve of these ``slopes`` between K other knots."""
        values = np.insert(self.values_of_slopes @ (slopes - self.own), self.zero, 0.0)
        there = values_at(Table(self.place, tuple(self.knots.tolist()), tuple(values.tolist())), knots)
        return np.diff(there) / (self.base * np.diff(knots)) + self.own

    def released(self, result: FitResult, use: Masks) -> Problem:
        """Return the problem of a fit with the curve's values next to its own unknowns."""
        problem = result.problem
        p = problem.p.copy()
        p[slot(self.name, COUNT)] = self.knots.size
        for i, knot in enumerate(self.knots.tolist()):
            p[slot(self.name, f"knot_{i + 1}")] = knot
        more = [
            Shared(self.name, f"value_{i + 1}", 1.0, -np.inf, np.inf, 0.0)
            for i in range(self.knots.size)
            if i != self.zero
        ]
        if self.yields:
            p[slot(SLIDER, "sharpness")] = SUDDEN
        return replace(problem, p=p, shared=(*problem.shared, *more, *self.more), use=use)


def curve_at(place: str, result: FitResult, gain: float) -> Curve | None:
    """Lay the knots of a curve by where the line was; None where it hardly moved there."""
    problem = result.problem
    k, c = (float(result.p[slot("", name)]) for name in ("k", "c"))
    torque = torque_scale([problem.records[drive[0]] for drive in problem.drives])
    yields = place == YIELDING
    place = "shaft_twist" if yields else place
    signal = signal_over(place, result, gain)
    low, high = (float(each) for each in np.quantile(signal, [0.005, 0.995]))
    knots = _knots(signal, low, high)
    if knots is None:
        return None
    top = max(abs(low), abs(high))
    damping = Shared(PREFIX + place, DAMPING, c or 0.02 * np.sqrt(k), 0.0, 5.0, 0.1)
    if yields:
        knots = np.array([0.0, top])  # straight on at both ends
        level = Shared(SLIDER, "friction_nm", torque, 0.0, 4.0, LEVEL)
        twist = Shared(SLIDER, "yield_rad", torque / k, 0.02, 4.0, LEVEL)
        return Curve(place, knots, k, 1.0, (0.0, 1.0), (damping, level, twist))
    if place == "shaft_twist":
        return Curve(place, knots, k, 1.0, (0.0, 8.0), (damping,))
    if place == "torque":
        return Curve(place, knots, 1.0, 1.0, (0.0, 3.0), ())
    return Curve(place, knots, torque / top, 0.0, (-10.0, 10.0), ())


def _knots(signal: FloatArray, low: float, high: float) -> FloatArray | None:
    """Return the knots for a signal in use between two values: around zero, or evenly; none between too few samples."""
    if not high - low > 1e-9 * max(abs(low), abs(high), 1e-300):
        return None
    if low < 0.0 < high and min(-low, high) > 0.1 * max(-low, high):
        top = REACH * max(-low, high)
        knots = np.concatenate([-top * np.array(FRACTIONS)[::-1], [0.0], top * np.array(FRACTIONS)])
    else:
        knots = np.linspace(low, high, EVEN_KNOTS)
    kept = [0]
    for i in range(1, knots.size):
        between = np.count_nonzero((signal >= knots[kept[-1]]) & (signal < knots[i]))
        if between >= FEWEST_SAMPLES or knots[i] == 0.0 or i == knots.size - 1:
            kept.append(i)
    found = knots[kept]
    return found if found.size > 2 else None


def _outward(anchor: float, knots: FloatArray, signal: FloatArray) -> list[float]:
    """Return rising knots above an anchor, samples enough between each two; the last one stays before all others."""
    kept = [anchor]
    for knot in knots[knots > anchor]:
        if np.count_nonzero((signal >= kept[-1]) & (signal < knot)) >= FEWEST_SAMPLES:
            kept.append(float(knot))
        elif knot == knots[-1] and len(kept) > 1:
            kept[-1] = float(knot)
    return kept[1:]


def signal_over(place: str, result: FitResult, gain: float) -> FloatArray:
    """Return what a curve is over in all recordings, (N,): of an observer of the readings, of a free run at gain 0."""
    problem, found = result.problem, []
    for first, *_ in problem.drives:
        case = case_of(problem.local[first], result.p, result.local_of(first))
        p = case.p.copy()
        p[slot("", OBSERVER)] = gain
        found.append(signal_of(place, problem.grid, problem.records[first], replace(case, p=p)))
    signal = np.concatenate(found)
    return signal[np.isfinite(signal)]


def values_at(table: Table, x: FloatArray) -> FloatArray:
    """Return a curve's torque at each ``x``, shape (N,) [Nm]; beyond its knots it goes straight on."""
    p = flat_values({}, {table.name: {key: each.value for key, each in table.effect().items()}})
    return curve_over(x, p, slot(table.name, COUNT))


def shapes(curve: Curve) -> dict[str, FloatArray]:
    """Return slopes from which a curve is fitted, by name."""
    at = 0.5 * (curve.knots[1:] + curve.knots[:-1]) / np.abs(curve.knots).max()  # in the middle of each piece
    one = np.ones(at.size)
    if curve.yields:
        return {"slipping": 0.0 * one}
    straight = {"straight": curve.own * one}
    if curve.place in ("shaft_twist", "torque"):
        return straight | {
            "gap": np.where(np.abs(at) < 0.13, 0.02, 1.0),
            "one-sided": np.where(at > 0.0, 1.0, 0.02),
            "one-sided, backwards": np.where(at < 0.0, 1.0, 0.02),
            "limited": np.where(np.abs(at) < 0.2, 1.0, 0.05),
            "hardening": 0.7 + 0.5 * (3.0 * at) ** 2,
        }
    if curve.knots[0] < 0.0 < curve.knots[-1]:
        return straight | {"step": np.where(np.abs(at) < 0.1, 0.5, 0.0), "one-sided": np.where(at > 0.0, 0.1, 0.0)}
    return straight
