"""A curve that is fitted in the free run: its knots, its unknowns, where it starts, and how it is fitted.

A curve's unknowns are the slopes between its knots, which are laid by the data, and its level where the recordings show
it. What the line could carry itself, a slope and a constant torque, stays with it as it is without the curve:
recordings tell the sum alone, and the curve is what the line lacks. A fit from a straight curve stays near it where the
law is strongly nonlinear, as a gap or a freewheel is: so each place starts from several shapes, under an observer whose
gain is let down to 0 (``layout.OBSERVER``). With a large one every sample is a fresh start, and no simulation runs
away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.thresholds import Curves
from estimator.least_squares import minimise
from estimator.physics.catalogue import EFFECTS
from estimator.physics.curve import curve_over
from estimator.physics.fit import FitResult
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import LOAD, OBSERVER, flat_values, slot
from estimator.physics.motion import torque_scale
from estimator.physics.problem import Problem, bounds, case_of, outputs_at, own_part, residual_at
from estimator.physics.table_signals import signal_of
from estimator.physics.tables import COUNT, DAMPING, PLACES, PREFIX, Table
from estimator.physics.unknowns import LOAD_TORQUE, Shared
from estimator.signals.record import BoolArray, FloatArray

STRAIGHT = {"shaft_twist": "k", "shaft_rate": "c", "motor_speed": "b_M", "load_speed": "b_L"}
"""Parameter of the line that a straight curve at a place does the same as."""

LEVELLED = frozenset({"torque", "motor_speed", "load_speed"})
"""Places at which a curve that is constant does the same as a constant load. The load of the first recording stays as
it is without the curve there, and so does the friction that a straight curve is. In a shaft a constant torque is a turn
of its twist's zero, and the curve is 0 at one knot; its stiffness is part of the torque over the twist, and moves."""

YIELDING, SLIDER = "shaft_yielding", "shaft_hysteresis"
"""A torque over the twist that yields, as a clutch slips: a straight curve and the slider of this effect."""

LEVEL, SUDDEN = 0.7, 10.0  # where its level starts, in the torque in use, and its knee

Z95 = 1.96  # half of a 95 % interval, in standard deviations

GAINS = (0.3, 0.1, 0.03, 0.01, 0.0)
"""Gains of the observer, one after the other."""

SCOUTS, SCOUT_STEPS, STEPS, LAST_STEPS = 2, 3, 4, 10
"""Gains after which only the best shapes and places continue; Jacobians at each gain there, behind, and at the end."""

SMOOTHNESS = (1.0, 0.05)
"""Weights of the curve's bending that are tried: what its slope changes by from one piece to the next, squared, counts
as so many thousandths of the squared error before."""

Masks = tuple[BoolArray, ...]
"""Which samples count, per recording."""


def alike(shared: Sequence[Shared], place: str) -> list[int]:
    """Return where the unknowns stand, among some, that recordings tell only together with a curve at a place.

    They are the line's parameter that a straight curve does the same as, and the values of named laws of the same part.
    """
    part, straight = PLACES[place].element, STRAIGHT.get(place)
    return [
        i
        for i, each in enumerate(shared)
        if (EFFECTS[each.effect].element is part if each.effect else each.name == straight)
    ]


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
        """How many slopes it has."""
        return self.knots.size - 1

    @property
    def zero(self) -> int:
        """The knot at which the value is the level."""
        return int(np.argmin(np.abs(self.knots)))

    @property
    def free(self) -> list[int]:
        """The knots whose values are unknown: all, or those but ``zero``."""
        return [i for i in range(self.knots.size) if self.place in LEVELLED or i != self.zero]

    @property
    def null(self) -> FloatArray:
        """Unknowns, shape (U,), of a curve that does nothing: its own slopes, and a level of 0 where it has one."""
        return np.append(np.full(self.pieces, self.own), np.zeros(len(self.free) - self.pieces))

    @cached_property
    def of_unknowns(self) -> FloatArray:
        """Matrix from slopes, less its own, and the level to the values that are unknown; shape (U, U)."""
        steps = self.base * np.diff(self.knots)
        sums = np.vstack([np.zeros(self.pieces), np.tril(np.ones((self.pieces, self.pieces))) * steps])
        level = np.full((self.knots.size, 1), self.base * np.abs(self.knots).max())
        return np.hstack([sums - sums[self.zero], level])[self.free, : len(self.free)]

    def values(self, unknowns: FloatArray) -> FloatArray:
        """Return the values at all knots, shape (K,) [Nm], of slopes and the level, shape (U,)."""
        found = np.zeros(self.knots.size)
        found[self.free] = self.of_unknowns @ (unknowns - self.null)
        return found

    def drawn_in(self, signal: FloatArray) -> Curve:
        """Return the curve with knots where a simulation with it was, ``signal`` (N,), and none beyond.

        They are laid before the fit, by a simulation without the curve: with it, a shaft that slips turns on.
        """
        inside = self.knots[(self.knots > signal.min()) & (self.knots < signal.max())]
        anchor = self.knots[self.zero]
        sides = [np.append(-inside[::-1], -signal.min()), np.append(inside, signal.max())]
        down, up = (_outward(sign * anchor, side, sign * signal) for sign, side in zip((-1.0, 1.0), sides, strict=True))
        return replace(self, knots=np.array([*(-each for each in reversed(down)), anchor, *up]))

    def through(self, other: Curve, unknowns: FloatArray) -> FloatArray:
        """Return the unknowns with which this curve is another one of ``unknowns``, at its own knots."""
        table = Table(self.place, tuple(other.knots.tolist()), tuple(other.values(unknowns).tolist()))
        there = values_at(table, self.knots)
        slopes = np.diff(there) / (self.base * np.diff(self.knots))
        level = there[self.zero] / (self.base * np.abs(self.knots).max())
        return self.null + np.append(slopes, level)[: len(self.free)]

    def released(self, result: FitResult, use: Masks) -> Problem:
        """Return the problem of a fit with the curve's values next to its own unknowns."""
        problem = result.problem
        p = problem.p.copy()
        p[slot(self.name, COUNT)] = self.knots.size
        for i, knot in enumerate(self.knots.tolist()):
            p[slot(self.name, f"knot_{i + 1}")] = knot
        more = [Shared(self.name, f"value_{i + 1}", 1.0, -np.inf, np.inf, 0.0) for i in self.free]
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
    if low < 0.0 < high and min(-low, high) > Curves.TWO_SIDED * max(-low, high):
        top = Curves.REACH * max(-low, high)
        knots = np.concatenate([-top * np.array(Curves.FRACTIONS)[::-1], [0.0], top * np.array(Curves.FRACTIONS)])
    else:
        knots = np.linspace(low, high, Curves.EVEN_KNOTS)
    kept = [0]
    for i in range(1, knots.size):
        between = np.count_nonzero((signal >= knots[kept[-1]]) & (signal < knots[i]))
        if between >= Curves.FEWEST_SAMPLES or knots[i] == 0.0 or i == knots.size - 1:
            kept.append(i)
    found = knots[kept]
    return found if found.size > 2 else None


def _outward(anchor: float, knots: FloatArray, signal: FloatArray) -> list[float]:
    """Return rising knots above an anchor, samples enough between each two; the last one stays before all others."""
    kept = [anchor]
    for knot in knots[knots > anchor]:
        if np.count_nonzero((signal >= kept[-1]) & (signal < knot)) >= Curves.FEWEST_SAMPLES:
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
            "gap": np.where(np.abs(at) < Curves.GAP, 0.02, 1.0),
            "one-sided": np.where(at > 0.0, 1.0, 0.02),
            "one-sided, backwards": np.where(at < 0.0, 1.0, 0.02),
            "limited": np.where(np.abs(at) < Curves.LIMIT, 1.0, 0.05),
            "hardening": 0.7 + 0.5 * (3.0 * at) ** 2,
        }
    if curve.knots[0] < 0.0 < curve.knots[-1]:
        step = np.where(np.abs(at) < Curves.STEP, 0.5, 0.0)
        return straight | {"step": step, "one-sided": np.where(at > 0.0, 0.1, 0.0)}
    return straight


class Descent:
    """The fit of one curve: unknowns are the line's, the curve's slopes, level and damping, and the recordings' own."""

    def __init__(self, curve: Curve, result: FitResult, use: Masks) -> None:
        self.curve, self.problem = curve, curve.released(result, use)
        self.first = len(result.problem.shared)
        self.after = self.first + len(curve.free)
        self._x0 = result.x
        self._scale = np.sqrt(max(result.squares, 1e-300) / 1000.0)
        low, high = bounds(self.problem)
        slopes = slice(self.first, self.first + curve.pieces)
        low[slopes], high[slopes] = curve.most
        known = self.problem.shared[: self.first]
        straight = [i for i in alike(known, curve.place) if not known[i].effect]
        held = [*straight, self._load()] if curve.place in LEVELLED else []
        low[held] = high[held] = self.start(np.empty(0))[held]
        self.low, self.high = low, high

    def _load(self) -> int:
        """Return where the constant load of all recordings stands, or that of the first one that is fitted."""
        problem, known = self.problem, self.problem.shared[: self.first]
        common = [i for i, each in enumerate(known) if not each.effect and each.name == LOAD]
        used = next((i for i, use in enumerate(problem.use) if use.any()), 0)
        return common[0] if common else own_part(problem, used).start + LOAD_TORQUE

    def start(self, slopes: FloatArray) -> FloatArray:
        """Return unknowns with these slopes, all else as the line had it."""
        own, of_curve = [each.start for each in self.curve.more], self.curve.null
        of_curve[: slopes.size] = slopes
        return np.concatenate([self._x0[: self.first], of_curve, own, self._x0[self.first :]])

    def x(self, z: FloatArray) -> FloatArray:
        """Return the scaled unknowns of the problem: values in the place of slopes."""
        x, of_curve = z.copy(), slice(self.first, self.after)
        x[of_curve] = self.curve.values(z[of_curve])[self.curve.free]
        return x

    def at(self, gain: float) -> Problem:
        """Return the problem simulated as an observer of the readings at a gain; at 0 it is a free run."""
        p = self.problem.p.copy()
        p[slot("", OBSERVER)] = gain
        return replace(self.problem, p=p)

    def fitted(self, z: FloatArray, gain: float, smooth: float, steps: int) -> tuple[FloatArray, float]:
        """Return unknowns after some steps at a gain, and the squared error there."""
        problem, seen = self.at(gain), dict[bytes, tuple[FloatArray, ...]]()
        of_curve = slice(self.first, self.after)
        each = np.eye(self.curve.pieces, len(self.curve.free))  # a level is free
        penalty = np.sqrt(smooth) * np.vstack([np.diff(each, axis=0), 1e-2 * each])
        rows = np.zeros((penalty.shape[0], z.size))
        rows[:, of_curve] = penalty

        def outputs(z: FloatArray) -> tuple[FloatArray, ...]:
            key = z.tobytes()
            if key not in seen:
                seen.clear()
                seen[key] = outputs_at(problem, self.x(z))
            return seen[key]

        def residual(z: FloatArray) -> FloatArray:
            bent = penalty @ (z[of_curve] - self.curve.null)  # other unknowns may be infinite, as a limit of none is
            return np.concatenate([residual_at(problem, outputs(z)) / self._scale, bent])

        def jacobian(z: FloatArray) -> FloatArray:
            found = jacobian_at(problem, self.x(z), outputs(z))
            found[:, of_curve] = found[:, of_curve] @ self.curve.of_unknowns
            return np.vstack([found / self._scale, rows])

        solution = minimise(residual, jacobian, z, self.low, self.high, steps)
        size = rows.shape[0]
        return solution.x, float(np.sum((self._scale * solution.residual[:-size]) ** 2))

    def error(self, z: FloatArray, masks: Masks) -> float:
        """Return the RMS of the free-run error over some samples."""
        return rms_over(self.at(0.0), outputs_at(self.at(0.0), self.x(z)), masks)


def rms_over(problem: Problem, outputs: Sequence[FloatArray], masks: Masks) -> float:
    """Return the RMS of the errors of first outputs over some samples, without those of a lead [unit of the output]."""
    rows = zip(problem.records, outputs, masks, strict=True)
    errors = [(out - record.output)[mask] for record, out, mask in rows if record.lead is None]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


@dataclass(frozen=True)
class Candidate:
    """The best curve of a place, fitted to the samples that fit."""

    descent: Descent  # for this place
    z: FloatArray  # unknowns, scaled
    smooth: float  # weight of the curve's second differences
    chosen_by: float  # RMS over the samples that choose

    def refitted(self, result: FitResult, use: Masks) -> Candidate:
        """Return the same curve fitted to other samples, from where it is."""
        descent = Descent(self.descent.curve, replace(result, x=result.x), use)
        z, _ = descent.fitted(self.z, 0.0, self.smooth, LAST_STEPS)
        return replace(self, descent=descent, z=z)

    def drawn_in(self, result: FitResult, use: Masks) -> Candidate:
        """Draw the knots in to where the simulation with the curve was; fitted once more where that changes it."""
        old, of_curve = self.descent.curve, slice(self.descent.first, self.descent.after)
        curve = old.drawn_in(signal_over(old.place, with_curve(self), 0.0))
        through = curve.through(old, self.z[of_curve])
        descent = Descent(curve, result, use)
        z = np.concatenate([self.z[: of_curve.start], through, self.z[of_curve.stop :]])
        if not curve.yields:  # a straight one is the same through any knots
            z, _ = descent.fitted(z, 0.0, self.smooth, LAST_STEPS)
        return replace(self, descent=descent, z=z)


Scouted = tuple[Descent, list[tuple[float, FloatArray]]]
"""A place after the first gains: squared error and unknowns that its shapes leave there, the best of them first."""


def scouted(curve: Curve, retuned: FitResult, fitting: Masks) -> Scouted:
    """Begin the fit of a curve from each of its shapes."""
    descent, left = Descent(curve, retuned, fitting), []
    for slopes in shapes(curve).values():
        z, squares = descent.start(slopes), np.inf
        for gain in GAINS[:SCOUTS]:
            z, squares = descent.fitted(z, gain, SMOOTHNESS[0], SCOUT_STEPS)
        left.append((squares, z))
    return descent, sorted(left, key=lambda each: each[0])


def best_curve(start: Scouted, choosing: Masks) -> Candidate:
    """Let the observer's gain down from the best shapes, and return what the choosing samples prefer."""
    (descent, left), found = start, list[Candidate]()
    for _, z in left[: Curves.CONTINUED]:
        for gain in GAINS[SCOUTS:]:
            z, _ = descent.fitted(z, gain, SMOOTHNESS[0], STEPS)
        found.append(Candidate(descent, z, SMOOTHNESS[0], descent.error(z, choosing)))
    best = min(found, key=lambda each: each.chosen_by)
    for smooth in SMOOTHNESS[1:]:
        z, _ = descent.fitted(best.z, 0.0, smooth, STEPS)
        best = min(best, Candidate(descent, z, smooth, descent.error(z, choosing)), key=lambda each: each.chosen_by)
    return best


def with_curve(found: Candidate) -> FitResult:
    """Return the fit with the curve among what is given: a free run."""
    descent = found.descent
    problem, x = descent.at(0.0), descent.x(found.z)
    outputs = outputs_at(problem, x)
    added = range(descent.first, descent.after + len(descent.curve.more))
    p = problem.p.copy()
    for i in added:
        p[problem.shared[i].slot] = problem.shared[i].scale * x[i]
    given = replace(problem, p=p, shared=problem.shared[: descent.first])
    return FitResult(given, np.delete(x, added), outputs, residual_at(problem, outputs), None, False)
