"""A curve that is fitted: its knots, laid by where the line was, its unknowns, and the shapes it is begun from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.physics.fit import FitResult
from estimator.physics.layout import OBSERVER, slot
from estimator.physics.motion import torque_scale
from estimator.physics.problem import Problem, case_of
from estimator.physics.table_signals import signal_of
from estimator.physics.tables import COUNT, DAMPING, PREFIX
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

LEVEL, SUDDEN, REACH_OF_SLIP = 0.7, 10.0, 100.0  # its start in the torque in use, knee, reach in the twist without it

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
    reached: tuple[float, float]  # values of the signal that the recordings contain

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
    signal = np.concatenate(_signals(place, result, gain))
    signal = signal[np.isfinite(signal)]
    low, high = (float(each) for each in np.quantile(signal, [0.005, 0.995]))
    knots = _knots(signal, low, high)
    if knots is None:
        return None
    top = max(abs(low), abs(high))
    damping = Shared(PREFIX + place, DAMPING, c or 0.02 * np.sqrt(k), 0.0, 5.0, 0.1)
    if yields:
        knots = REACH_OF_SLIP * top * np.array([-1.0, 0.0, 1.0])
        level = Shared(SLIDER, "friction_nm", torque, 0.0, 4.0, LEVEL)
        twist = Shared(SLIDER, "yield_rad", torque / k, 0.02, 4.0, LEVEL)
        return Curve(place, knots, k, 1.0, (0.0, 1.0), (damping, level, twist), (low, high))
    if place == "shaft_twist":
        return Curve(place, knots, k, 1.0, (0.0, 8.0), (damping,), (low, high))
    if place == "torque":
        return Curve(place, knots, 1.0, 1.0, (0.0, 3.0), (), (low, high))
    return Curve(place, knots, torque / top, 0.0, (-10.0, 10.0), (), (low, high))


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


def _signals(place: str, result: FitResult, gain: float) -> list[FloatArray]:
    """Return what a curve is over in every recording, of a simulation that follows the readings a little."""
    problem, found = result.problem, []
    for first, *_ in problem.drives:
        case = case_of(problem.local[first], result.p, result.local_of(first))
        p = case.p.copy()
        p[slot("", OBSERVER)] = gain
        found.append(signal_of(place, problem.grid, problem.records[first], replace(case, p=p)))
    return found


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
