"""Laws without a name as tables: at each place the curve with which the free run fits best, if any is better.

A curve's unknowns are the slopes between its knots, which are laid by the data. A fit from a straight curve stays near
it where the law is strongly nonlinear, as a gap or a freewheel is: so each place is begun from several shapes, under an
observer whose gain is let down to 0 (``layout.OBSERVER``). With a large one every sample is a fresh start, and no
simulation runs away.

The samples of each recording are cut into blocks: on some the curve is fitted, others choose its shape, its smoothness
and its place, and the rest, which no choice has seen, say whether it is a law at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.table_words import looks_like, shortest_formula
from estimator.physics.driveline import Structure
from estimator.physics.fit import ITERATIONS, FitResult, fit
from estimator.physics.free_run import simulate_foreign
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import OBSERVER, slot
from estimator.physics.least_squares import minimise
from estimator.physics.model import DrivelineModel
from estimator.physics.motion import torque_scale
from estimator.physics.problem import Problem, bounds, case_of, outputs_at, residual_at
from estimator.physics.table_signals import signal_of
from estimator.physics.tables import COUNT, DAMPING, PREFIX, Table
from estimator.physics.unknowns import Shared
from estimator.signals.correlation import effective_samples
from estimator.signals.record import BoolArray, FloatArray, Record

SEARCHED = {
    Structure.ONE_MASS: ("torque", "motor_speed"),
    Structure.TWO_MASS: ("torque", "motor_speed", "shaft_twist", "shaft_rate", "load_speed"),
    Structure.THREE_MASS: ("torque", "motor_speed", "shaft_twist", "shaft_rate", "load_speed"),
    Structure.JOINT: ("shaft_twist", "shaft_rate"),
}
"""Places at which a curve is looked for."""

BLOCKS, CHOOSING, UNSEEN = 10, (2, 7), (4, 9)
"""Blocks of equal length that each recording is cut into, and which of them choose and which judge; to the rest curves
are fitted. The last one judges: what has run away by then is no law."""

BETTER = 0.97
"""Error on the unseen blocks, over that of the re-tuned model, up to which a curve is a law."""

LOOK_ALIKE_SHARE = 1.1  # the same of a second place over the first, up to which both are reported

GAINS = (0.3, 0.1, 0.03, 0.01, 0.0)
"""Gains of the observer, one after the other."""

SCOUTS, SCOUT_STEPS, STEPS, LAST_STEPS = 2, 3, 4, 10
"""Gains after which only the best shapes and places continue; Jacobians at each gain there, behind, and at the end."""

CONTINUED = 2  # shapes of a place, and places, that continue
SMOOTHNESS = (1.0, 0.05)
"""Weights of the curve's bending that are tried: what its slope changes by from one piece to the next, squared, counts
as so many thousandths of the squared error before."""

REACH = 1.5  # knots reach to so many times what the re-tuned model reaches
FRACTIONS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of that, where they stand on both sides of zero
EVEN_KNOTS = 7  # knots of a signal of one sign, equally far apart
FEWEST_SAMPLES = 40  # samples between two knots at least
Z95 = 1.96


@dataclass(frozen=True)
class TableFit:
    """A law without a name, fitted."""

    table: Table
    result: FitResult  # the free run with it, the line re-tuned next to it; the curve stands in ``problem.p``
    before: float  # RMS of the free-run error on unseen samples without it [unit of the output]
    after: float  # and with it
    reached: tuple[float, float]  # between which values of its signal the recordings were
    rival: str = ""  # place that explains nearly as much
    rival_after: float = np.nan
    looks_like: str = ""
    formula: str = ""
    not_carried: tuple[str, ...] = ()  # recordings of which the unseen error does not fall
    simulations: int = 0

    @property
    def place(self) -> str:
        """Key of ``tables.PLACES``."""
        return self.table.place

    @property
    def knots(self) -> tuple[float, ...]:
        """Knots, rising [unit of the place]."""
        return self.table.knots

    @property
    def values(self) -> tuple[float, ...]:
        """Values at them [Nm]."""
        return self.table.values

    @property
    def ci95(self) -> tuple[tuple[float, float], ...] | None:
        """Their 95 % intervals [Nm]."""
        return self.table.ci95


Masks = tuple[BoolArray, ...]


def blocks_of(records: Sequence[Record], use: Sequence[BoolArray], which: Sequence[int]) -> Masks:
    """Return which samples that count lie in some of the blocks of their recording."""
    masks = []
    for record, used in zip(records, use, strict=True):
        since = record.time_s - record.time_s[0]
        block = np.minimum((BLOCKS * since / max(float(since[-1]), 1e-12)).astype(int), BLOCKS - 1)
        masks.append(used & np.isin(block, which))
    return tuple(masks)


@dataclass(frozen=True)
class Curve:
    """A curve that is fitted: its knots, and the unknowns that a fit of the line gets with it."""

    place: str
    knots: FloatArray
    base: float  # slope in which those of the curve count [Nm/unit of the place]
    own: float  # slope that the line has without it, in ``base``
    most: tuple[float, float]  # bounds of the slopes, its own among them
    damping: float  # scale of a damping of its own; 0 where it has none
    reached: tuple[float, float]

    @property
    def name(self) -> str:
        return PREFIX + self.place

    @property
    def pieces(self) -> int:
        """How many slopes it has: as many as values that are not 0."""
        return self.knots.size - 1

    @property
    def zero(self) -> int:
        """The knot whose value is 0: what is constant is the load's."""
        return int(np.argmin(np.abs(self.knots)))

    @property
    def middles(self) -> FloatArray:
        return 0.5 * (self.knots[1:] + self.knots[:-1])

    @cached_property
    def values_of_slopes(self) -> FloatArray:
        """Matrix from slopes, less its own, to the values but that of knot ``zero``; shape (pieces, pieces)."""
        steps = self.base * np.diff(self.knots)
        sums = np.vstack([np.zeros(self.pieces), np.tril(np.ones((self.pieces, self.pieces))) * steps])
        return np.delete(sums - sums[self.zero], self.zero, axis=0)

    @property
    def free(self) -> list[int]:
        return [i for i in range(self.knots.size) if i != self.zero]

    def released(self, result: FitResult, use: Masks) -> Problem:
        """Return the problem of a fit with the curve's values next to its own unknowns."""
        problem = result.problem
        p = problem.p.copy()
        p[slot(self.name, COUNT)] = self.knots.size
        for i, knot in enumerate(self.knots.tolist()):
            p[slot(self.name, f"knot_{i + 1}")] = knot
        more = [Shared(self.name, f"value_{i + 1}", 1.0, -np.inf, np.inf, 0.0) for i in self.free]
        if self.damping:
            more.append(Shared(self.name, DAMPING, self.damping, 0.0, 5.0, 0.0))
        return replace(problem, p=p, shared=(*problem.shared, *more), use=use)


def _curve(place: str, result: FitResult, gain: float) -> Curve | None:
    """Lay the knots of a curve by where the line was; None where it hardly moved there."""
    problem = result.problem
    k, c = (float(result.p[slot("", name)]) for name in ("k", "c"))
    torque = torque_scale([problem.records[drive[0]] for drive in problem.drives])
    signal = np.concatenate(_signals(place, result, gain))
    signal = signal[np.isfinite(signal)]
    low, high = (float(each) for each in np.quantile(signal, [0.005, 0.995]))
    knots = _knots(signal, low, high)
    if knots is None:
        return None
    top = max(abs(low), abs(high))
    if place == "shaft_twist":
        return Curve(place, knots, k, 1.0, (0.0, 8.0), c or 0.02 * np.sqrt(k), (low, high))
    if place == "torque":
        return Curve(place, knots, 1.0, 1.0, (0.0, 3.0), 0.0, (low, high))
    return Curve(place, knots, torque / top, 0.0, (-10.0, 10.0), 0.0, (low, high))


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


def _shapes(curve: Curve) -> dict[str, FloatArray]:
    """Return slopes from which a curve is fitted, by name."""
    at = curve.middles / np.abs(curve.knots).max()
    one = np.ones(at.size)
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


class _Descent:
    """The fit of one curve: unknowns are those of the line, the curve's slopes and damping, and the recordings' own."""

    def __init__(self, curve: Curve, result: FitResult, use: Masks) -> None:
        self.curve, self.problem = curve, curve.released(result, use)
        self.first = len(result.problem.shared)
        self.after = self.first + curve.pieces
        self.simulations = 0
        self._x0 = result.x
        self._scale = np.sqrt(max(result.squares, 1e-300) / 1000.0)
        low, high = bounds(self.problem)
        low[self.first : self.after], high[self.first : self.after] = curve.most
        self.low, self.high = low, high

    def start(self, slopes: FloatArray) -> FloatArray:
        """Return unknowns with these slopes, all else as the line had it."""
        damping = [0.1] if self.curve.damping else []
        return np.concatenate([self._x0[: self.first], slopes, damping, self._x0[self.first :]])

    def x(self, z: FloatArray) -> FloatArray:
        """Return the scaled unknowns of the problem: values in the place of slopes."""
        x = z.copy()
        slopes = z[self.first : self.after] - self.curve.own
        x[self.first : self.after] = self.curve.values_of_slopes @ slopes
        return x

    def at(self, gain: float) -> Problem:
        p = self.problem.p.copy()
        p[slot("", OBSERVER)] = gain
        return replace(self.problem, p=p)

    def fitted(self, z: FloatArray, gain: float, smooth: float, steps: int) -> tuple[FloatArray, float]:
        """Return unknowns after some steps at a gain, and the squared error there."""
        problem, seen = self.at(gain), dict[bytes, tuple[FloatArray, ...]]()
        bend = np.zeros((self.curve.pieces - 1, z.size))
        bend[:, self.first : self.after] = np.sqrt(smooth) * np.diff(np.eye(self.curve.pieces), axis=0)
        ridge = np.zeros((self.curve.pieces, z.size))
        ridge[:, self.first : self.after] = 1e-2 * np.sqrt(smooth) * np.eye(self.curve.pieces)
        rows = np.vstack([bend, ridge])
        least = z.copy()
        least[self.first : self.after] = self.curve.own

        def outputs(z: FloatArray) -> tuple[FloatArray, ...]:
            key = z.tobytes()
            if key not in seen:
                seen.clear()
                seen[key] = outputs_at(problem, self.x(z))
                self.simulations += 1
            return seen[key]

        def residual(z: FloatArray) -> FloatArray:
            return np.concatenate([residual_at(problem, outputs(z)) / self._scale, rows @ (z - least)])

        def jacobian(z: FloatArray) -> FloatArray:
            found = jacobian_at(problem, self.x(z), outputs(z))
            self.simulations += self.after + 4
            found[:, self.first : self.after] = found[:, self.first : self.after] @ self.curve.values_of_slopes
            return np.vstack([found / self._scale, rows])

        solution = minimise(residual, jacobian, z, self.low, self.high, steps)
        size = rows.shape[0]
        return solution.x, float(np.sum((self._scale * solution.residual[:-size]) ** 2))

    def error(self, z: FloatArray, masks: Masks) -> float:
        """Return the RMS of the free-run error over some samples."""
        return rms_over(self.at(0.0), outputs_at(self.at(0.0), self.x(z)), masks)


def rms_over(problem: Problem, outputs: Sequence[FloatArray], masks: Masks) -> float:
    """Return the RMS of the errors of first outputs over some samples [unit of the output]."""
    return float(np.sqrt(np.mean(np.concatenate(_errors(problem, outputs, masks)) ** 2)))


def _errors(problem: Problem, outputs: Sequence[FloatArray], masks: Masks) -> list[FloatArray]:
    rows = zip(problem.records, outputs, masks, strict=True)
    return [(out - record.output)[mask] for record, out, mask in rows if record.lead is None]


@dataclass(frozen=True)
class Candidate:
    """The best curve of a place, fitted to the samples that fit."""

    descent: _Descent
    z: FloatArray
    smooth: float
    chosen_by: float  # RMS over the samples that choose


@dataclass(frozen=True)
class Scouted:
    """A place after the first gains: what its shapes leave there, the best of them first."""

    descent: _Descent
    left: list[tuple[float, FloatArray]]  # squared error and unknowns

    @property
    def least(self) -> float:
        """Squared error that the best shape leaves at the last of the first gains."""
        return self.left[0][0]


def _scouted(curve: Curve, retuned: FitResult, fitting: Masks) -> Scouted:
    """Begin the fit of a curve from each of its shapes."""
    descent, left = _Descent(curve, retuned, fitting), []
    for slopes in _shapes(curve).values():
        z, squares = descent.start(slopes), np.inf
        for gain in GAINS[:SCOUTS]:
            z, squares = descent.fitted(z, gain, SMOOTHNESS[0], SCOUT_STEPS)
        left.append((squares, z))
    return Scouted(descent, sorted(left, key=lambda each: each[0]))


def _best_curve(scouted: Scouted, choosing: Masks) -> Candidate:
    """Let the observer's gain down from the best shapes, and return what the choosing samples prefer."""
    descent, found = scouted.descent, list[Candidate]()
    for _, z in scouted.left[:CONTINUED]:
        for gain in GAINS[SCOUTS:]:
            z, _ = descent.fitted(z, gain, SMOOTHNESS[0], STEPS)
        found.append(Candidate(descent, z, SMOOTHNESS[0], descent.error(z, choosing)))
    best = min(found, key=lambda each: each.chosen_by)
    for smooth in SMOOTHNESS[1:]:
        z, _ = descent.fitted(best.z, 0.0, smooth, STEPS)
        best = min(best, Candidate(descent, z, smooth, descent.error(z, choosing)), key=lambda each: each.chosen_by)
    return best


def table_at(hypothesis: Hypothesis, place: str) -> Candidate | None:
    """Return the free form of a law at a place, fitted to all samples that count; None where the line hardly moved."""
    result = hypothesis.result.first_outputs()
    curve = None if place not in SEARCHED[result.problem.grid.structure] else _curve(place, result, GAINS[0])
    if curve is None:
        return None
    use = result.problem.use
    return _best_curve(_scouted(curve, result, use), use)


def best_table(
    hypothesis: Hypothesis, line: DrivelineModel | None = None, holdout: Sequence[Record] = ()
) -> TableFit | None:
    """Return the best law without a name next to a fitted hypothesis; None where none is better on unseen samples.

    ``holdout`` are recordings kept out of every fit, on which it must be better, too; they need the ``line`` they are
    simulated with.
    """
    whole = hypothesis.result.first_outputs()
    if whole.problem.grid.plant is not None:
        return None
    records, use = whole.problem.records, whole.problem.use
    unseen, choosing = (blocks_of(records, use, which) for which in (UNSEEN, CHOOSING))
    fitting = tuple(u & ~a & ~b for u, a, b in zip(use, unseen, choosing, strict=True))
    retuned = fit(replace(whole.problem, use=fitting), whole.x, STEPS)
    curves = [_curve(place, retuned, GAINS[0]) for place in SEARCHED[whole.problem.grid.structure]]
    places = [_scouted(curve, retuned, fitting) for curve in curves if curve is not None]
    if not places:
        return None
    continued = sorted(places, key=lambda each: each.least)[:CONTINUED]
    found = [_best_curve(each, choosing) for each in continued]
    seen = tuple(u & ~a for u, a in zip(use, unseen, strict=True))
    known = fit(replace(whole.problem, use=seen), whole.x, ITERATIONS)
    before = min(rms_over(known.problem, each.outputs, unseen) for each in (known, retuned))
    best, *others = sorted(found, key=lambda each: each.chosen_by)
    judged, z = _refitted(best, known, seen)
    of_law = _errors(judged.problem, outputs_at(judged.at(0.0), judged.x(z)), unseen)
    after = float(np.sqrt(np.mean(np.concatenate(of_law) ** 2)))
    if after > BETTER * before:
        return None
    last, z = _refitted(replace(best, descent=judged, z=z), whole, use)
    result, table = _reported(last, z)
    if holdout and line is not None and not _carries_to(result, whole, line, holdout):
        return None
    rival = others[0] if others and others[0].chosen_by < LOOK_ALIKE_SHARE * best.chosen_by else None
    pairs = zip(_errors(known.problem, known.outputs, unseen), of_law, strict=True)
    worse = [float(b @ b) > float(a @ a) for a, b in pairs]
    firsts = [record.name for record in records if record.lead is None]
    line_slope = last.curve.own * last.curve.base
    return TableFit(
        table,
        result,
        before,
        after,
        last.curve.reached,
        "" if rival is None else rival.descent.curve.place,
        np.nan if rival is None else rival.chosen_by,
        looks_like(table, line_slope),
        shortest_formula(table, line_slope),
        tuple(name for name, is_worse in zip(firsts, worse, strict=True) if is_worse),
        sum(each.descent.simulations for each in places) + judged.simulations + last.simulations,
    )


def _refitted(best: Candidate, result: FitResult, use: Masks) -> tuple[_Descent, FloatArray]:
    """Fit the best curve to other samples, from where it is."""
    descent = _Descent(best.descent.curve, replace(result, x=result.x), use)
    z, _ = descent.fitted(best.z, 0.0, best.smooth, LAST_STEPS)
    return descent, z


def _reported(descent: _Descent, z: FloatArray) -> tuple[FitResult, Table]:
    """Return the fit with the curve among what is given, and the curve with its intervals."""
    problem, x, curve = descent.at(0.0), descent.x(z), descent.curve
    outputs = outputs_at(problem, x)
    residual = residual_at(problem, outputs)
    values = np.insert(x[descent.first : descent.after], curve.zero, 0.0)
    half = np.insert(_half_widths(descent, problem, x, outputs, residual), curve.zero, 0.0)
    damping = float(x[descent.after] * curve.damping) if curve.damping else 0.0
    bands = tuple((float(v - h), float(v + h)) for v, h in zip(values, half, strict=True))
    table = Table(curve.place, tuple(curve.knots.tolist()), tuple(values.tolist()), bands, damping)
    added = range(descent.first, descent.after + bool(curve.damping))
    p = problem.p.copy()
    for i in added:
        p[problem.shared[i].slot] = problem.shared[i].scale * x[i]
    given = replace(problem, p=p, shared=problem.shared[: descent.first])
    return FitResult(given, np.delete(x, added), outputs, residual, None, False), table


def _half_widths(
    descent: _Descent, problem: Problem, x: FloatArray, outputs: Sequence[FloatArray], residual: FloatArray
) -> FloatArray:
    """Return half of the 95 % intervals of the values [Nm]: of errors that are worth fewer than they are."""
    derivative = jacobian_at(problem, x, outputs)
    free = np.flatnonzero(derivative.any(axis=0))
    j = derivative[:, free]
    variance = float(residual @ residual) / effective_samples([residual])
    scale = np.sqrt(np.maximum(np.diag(j.T @ j), 1e-300))
    inverse = np.linalg.pinv((j / scale).T @ (j / scale), rcond=1e-10, hermitian=True) / np.outer(scale, scale)
    spread = np.zeros(x.size)
    spread[free] = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance)
    return Z95 * spread[descent.first : descent.after]


def _carries_to(result: FitResult, before: FitResult, line: DrivelineModel, holdout: Sequence[Record]) -> bool:
    """Tell whether the error falls on recordings that no fit has seen, all together."""
    squares: list[float] = []
    for each in (before, result):
        errors = [
            (simulate_foreign(line, each.p, each.problem.grid, record, record.okay) - record.output)[record.okay]
            for record in holdout
        ]
        squares.append(sum(float(error @ error) for error in errors))
    return squares[1] < squares[0]
