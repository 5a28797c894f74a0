"""Score tests: which effects are worth a fit, and from where, under a hypothesis' own weighting."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimator.diagnosis.inference.disturbances import Whitener
from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.thresholds import Searching
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import Case
from estimator.physics.effect import Effect
from estimator.physics.fit import FitResult
from estimator.physics.model import DrivelineModel
from estimator.physics.own_scan import (
    Cells,
    Projector,
    Simulate,
    Stretch,
    Wave,
    answers_to,
    cell_s,
    cells,
    scanned,
    small_waves,
)
from estimator.physics.problem import simulated_cases, start_of
from estimator.physics.steps import Moments
from estimator.physics.unknowns import Release, Shared, effect_unknowns
from estimator.signals.record import FloatArray, Record

ROOM_SAMPLES = 2**21
"""Samples that are simulated in one call at most, in whole starts: side by side they take less time, and more room."""


Known = dict[bytes, FloatArray]
"""Changes of a recording's output, by a digest of the parameters that were changed."""


@dataclass(frozen=True, slots=True)
class ScoredStart:
    """A start of an effect's fit, and the fall of the squared error it promises to first order."""

    release: Release  # parameters to set free, and where they begin
    promise: float  # that fall, of errors as the projector weights them; 0: none

    @property
    def variant(self) -> frozenset[str]:
        """Which of the law's parameters are free: what is held makes it another variant."""
        return frozenset(unknown.name for unknown in self.release.shared if unknown.low < unknown.high)

    @property
    def shape(self) -> tuple[tuple[str, float], ...]:
        """Where the law's parameters start, but for its size: along that a look goes by itself."""
        free = [(unknown.name, unknown.start) for unknown in self.release.shared if unknown.low < unknown.high]
        return tuple(free[1:])


def promising(starts: Sequence[ScoredStart]) -> list[ScoredStart]:
    """Return the starts worth a fit: the best, and others where they promise nearly as much.

    These are the second best, and the best of other shapes, since a law has an optimum near each, and of every other
    variant: a look at one is no look at another.
    """
    near = [
        scored for scored in starts if scored.promise >= Searching.PROMISING * starts[0].promise or scored is starts[0]
    ]
    best = {(scored.variant, scored.shape): scored for scored in reversed(near)}
    distinct = [scored for scored in near[Searching.STARTS_OF_A_LAW :] if best[scored.variant, scored.shape] is scored]
    first = [*near[: Searching.STARTS_OF_A_LAW], *distinct[: Searching.SHAPES]]
    seen = {scored.variant for scored in first}
    others = {scored.variant: scored for scored in reversed(near) if scored.variant not in seen}
    return [*first, *others.values()]


@dataclass(frozen=True, slots=True)
class _Steps:
    """What a start of a plain effect is tried with: steps of its first free unknown from where that does nothing."""

    release: Release
    first: Shared
    zero: float
    sizes: tuple[float, ...]

    @classmethod
    def of(cls, entry: Effect, release: Release) -> _Steps:
        first = next(shared for shared in release.shared if shared.low < shared.high)
        null = next(parameter.null for parameter in entry.shared_parameters if parameter.name == first.name)
        zero = _zero(first, null)
        return cls(release, first, zero, tuple(share * (first.start - zero) for share in Searching.STEP_SHARES))

    def filled(self, p: FloatArray) -> list[FloatArray]:
        """Return parameters with each of the steps."""
        return [_filled(p, _with_start(self.release, self.first, self.zero + size).shared) for size in self.sizes]


class Screen:
    """Looks at effects around one fit."""

    def __init__(self, result: FitResult, model: DrivelineModel, projector: Projector | None = None) -> None:
        self._result = result
        self._model = model
        self._projector = projector or Projector(result)
        self._rows = result.problem.rows

    def starts(self, name: str) -> list[ScoredStart]:
        """Return a look at each start of an effect, the most promising first."""
        entry = EFFECTS[name]
        releases = effect_unknowns(name, self._model, self._result.problem.records)
        if entry.profile:
            return [ScoredStart(release, np.inf) for release in releases]
        looker = self._periodic if entry.phases else self._events if entry.event else self._plain
        return sorted(looker(entry, releases), key=lambda scored: -scored.promise)

    def handed_over(self, name: str, moments: Sequence[Moments]) -> list[ScoredStart]:
        """Return a look at each start of an event at moments that another event was found at, the best first.

        A moment belongs to what happened and not to the law that is tried on it: sought anew around a bad fit, it may
        be lost. ``moments`` are of each recording [s since it began]; a fit may move them by a cell of the grid.
        """
        entry, records = EFFECTS[name], self._result.problem.records
        found = []
        for release in effect_unknowns(name, self._model, records):
            own = tuple(_at_moments(*each) for each in zip(release.own, records, moments, strict=False))
            steps = _Steps.of(entry, _with_own(release, own))
            changes = []
            for i in range(len(self._rows)):
                began = _filled(self._result.p_of(i), own[i])
                changes.append(self._runner(i)(steps.filled(began)) - self._output(i))
            moved = self._stacked(changes)
            starts = [self._along(steps, step, change) for step, change in zip(steps.sizes, moved, strict=True)]
            found.append(max(starts, key=lambda scored: scored.promise))
        return sorted(found, key=lambda scored: -scored.promise)

    def _plain(self, entry: Effect, releases: Sequence[Release]) -> list[ScoredStart]:
        found = []
        for some in self._at_a_time(releases, len(Searching.STEP_SHARES)):
            tried = [_Steps.of(entry, release) for release in some]
            outputs = self._each([steps.filled for steps in tried])
            for steps, mine in zip(tried, outputs, strict=True):
                moved = self._stacked([output - self._output(i) for i, output in enumerate(mine)])
                starts = [self._along(steps, step, change) for step, change in zip(steps.sizes, moved, strict=True)]
                found.append(max(starts, key=lambda scored: scored.promise))
        return found

    def _at_a_time(self, releases: Sequence[Release], simulations: int) -> Iterator[Sequence[Release]]:
        """Return the starts that are looked at in one call, of so many simulations each: as many as there is room."""
        longest = max(record.time_s.size for record in self._result.problem.records)
        count = max(1, ROOM_SAMPLES // (simulations * longest))
        return (releases[first : first + count] for first in range(0, len(releases), count))

    def _each(self, tried: Sequence[Callable[[FloatArray], list[FloatArray]]]) -> list[list[FloatArray]]:
        """Simulate every recording with the parameters that several functions make of its own, in one call for all."""
        found = []
        for i in range(len(self._rows)):
            lists = [make(self._result.p_of(i)) for make in tried]
            ends = np.cumsum([len(each) for each in lists])
            found.append(np.split(self._runner(i)([p for each in lists for p in each]), ends[:-1]))
        return [list(each) for each in zip(*found, strict=True)]

    def _along(self, steps: _Steps, step: float, moved: FloatArray) -> ScoredStart:
        release, first, zero = steps.release, steps.first, steps.zero
        if not np.isfinite(moved).all():  # so far out that the line is unstable: this start promises nothing
            return ScoredStart(release, 0.0)
        ends = sorted((limit - zero) / step for limit in (first.low, first.high))
        most = Searching.LARGEST_SCALING * abs((first.start - zero) / step)
        reached, promise = self._projector.promise(moved, max(ends[0], -most), min(ends[1], most))
        least = Searching.SMALLEST_SCALING * abs((first.start - zero) / step)
        size = float(np.copysign(max(abs(reached), least), reached))
        return ScoredStart(
            _with_start(release, first, float(np.clip(zero + size * step, first.low, first.high))), promise
        )

    def _periodic(self, entry: Effect, releases: Sequence[Release]) -> list[ScoredStart]:
        found = []
        for some in self._at_a_time(releases, 2 * len(entry.phases)):
            outputs = self._each([partial(_waved, entry, release) for release in some])
            for release, mine in zip(some, outputs, strict=True):
                sizes = _sizes(release)
                answers = [answers_to(entry, sizes, output, self._output(i)) for i, output in enumerate(mine)]
                found.append(self._in_phase(release, answers))
        return found

    def _in_phase(self, release: Release, found: list[list[Wave]]) -> ScoredStart:
        if not all(np.isfinite(wave.answers @ wave.answers.T).all() for mine in found for wave in mine):
            return ScoredStart(release, 0.0)  # so far out that the line is unstable
        amplitudes, phases, promise = self._regress(found)
        shared = tuple(
            replace(u, start=float(np.clip(amplitudes[u.name] / u.scale, u.low, u.high))) if u.name in amplitudes else u
            for u in release.shared
        )
        own = tuple(
            tuple(replace(u, start=mine.get(u.name, u.start)) for u in unknowns)
            for unknowns, mine in zip(release.own, phases, strict=False)
        )
        return ScoredStart(_with_own(Release(shared, release.own), own), promise)

    def _regress(self, found: list[list[Wave]]) -> tuple[dict[str, float], list[dict[str, float]], float]:
        """Return the amplitudes all recordings share, the phases of each, and the promise."""
        parts: dict[str, list[tuple[float, float]]] = {}
        phases: list[dict[str, float]] = []
        for i, mine in enumerate(found):
            gram, match = self._projector.products(np.concatenate([wave.answers for wave in mine]), i)
            coefficients = -np.linalg.lstsq(gram, match, rcond=None)[0].reshape(-1, 2)
            phases.append({})
            for wave, (along, across), power in zip(
                mine, coefficients, np.diag(gram).reshape(-1, 2).sum(axis=1), strict=True
            ):
                parts.setdefault(wave.amplitude, []).append((float(np.hypot(along, across)), float(power)))
                phases[i][wave.phase] = float(np.arctan2(across, along))
        amplitudes = {
            name: float(np.average([size for size, _ in each], weights=[max(w, 1e-300) for _, w in each]))
            for name, each in parts.items()
        }
        change = np.zeros_like(self._projector.error)
        for i, (mine, angles) in enumerate(zip(found, phases, strict=True)):
            for wave in mine:
                angle = angles[wave.phase]
                turned = np.cos(angle) * wave.answers[0] + np.sin(angle) * wave.answers[1]
                change[self._rows[i]] += amplitudes[wave.amplitude] * turned
        return amplitudes, phases, self._projector.promise(change, 0.0, 1.0)[1]

    def _events(self, entry: Effect, releases: Sequence[Release]) -> list[ScoredStart]:
        return [self._event(entry, release) for release in releases]

    def _event(self, entry: Effect, release: Release) -> ScoredStart:
        sizes = _sizes(release)
        size = release.shared[0]
        grids = [
            cells(entry, _filled(self._result.p_of(i), release.shared), own, sizes, self._runner(i))
            for i, own in enumerate(release.own[: len(self._rows)])
        ]
        scans = [scanned(*self._projector.products(grid.answers, i), entry.lasting) for i, grid in enumerate(grids)]
        tried = [value for value in Searching.EVENT_SIZES * size.scale * abs(size.start) if self._may_be(size, value)]
        tried += [-value for value in tried if self._may_be(size, -value)]
        best = max(tried, key=lambda value: sum(each.best(value).error_reduction for each in scans))
        for _ in range(Searching.EVENT_ROUNDS):
            stretches = [each.best(best) for each in scans]
            power = sum(stretch.power for stretch in stretches)
            if power == 0.0:
                return ScoredStart(release, 0.0)
            best = float(
                np.clip(-sum(s.match for s in stretches) / power, size.low * size.scale, size.high * size.scale)
            )
        own = tuple(
            _between(unknowns, entry, grid, stretch)
            for unknowns, grid, stretch in zip(release.own, grids, stretches, strict=False)
        )
        found = _with_own(Release((replace(size, start=best / size.scale), *release.shared[1:]), release.own), own)
        change = self._stacked(
            [
                grid.answers[stretch.last] - grid.answers[stretch.first]
                for grid, stretch in zip(grids, stretches, strict=True)
            ]
        )
        return ScoredStart(found, self._projector.promise(best * change, 0.0, Searching.LARGEST_SCALING)[1])

    @staticmethod
    def _may_be(size: Shared, value: float) -> bool:
        return size.low * size.scale <= value <= size.high * size.scale

    def _runner(self, index: int) -> Simulate:
        problem = self._result.problem
        basis = problem.local[index]
        start = start_of(problem, self._result.x, index)
        extra = basis.extra_load(self._result.local_of(index))

        def run(parameters: Sequence[FloatArray], alike_s: FloatArray | None = None) -> FloatArray:
            cases = [Case(p, start, extra) for p in parameters]
            return simulated_cases(problem, cases, index, alike_s)

        return run

    def _output(self, index: int) -> FloatArray:
        """Return the samples that count of a recording, its outputs in turn, as the fit has them."""
        result = self._result
        return np.concatenate([result.outputs[i][result.problem.use[i]] for i in result.problem.drives[index]])

    def _stacked(self, parts: Sequence[FloatArray]) -> FloatArray:
        """Stack what there is of the samples that count of each recording, shapes (..., R_i)."""
        if len(parts) == 1:
            return parts[0]
        whole = np.empty((*parts[0].shape[:-1], self._projector.error.size))
        for rows, part in zip(self._rows, parts, strict=True):
            whole[..., rows] = part
        return whole


class _Weighted(Projector):
    """Takes signals as the simulation gives them, and weighs them as a hypothesis does."""

    def __init__(self, hypothesis: Hypothesis) -> None:
        super().__init__(hypothesis.white)
        self._filter: Whitener = hypothesis.filter

    def products(self, answers: FloatArray, index: int) -> tuple[FloatArray, FloatArray]:
        return super().products(self._filter.part(index, answers.T).T, index)

    def promise(self, direction: FloatArray, low: float, high: float) -> tuple[float, float]:
        white = self._filter(direction)
        return super().promise(white, low, high) if np.isfinite(white @ white) else (0.0, 0.0)


class WeightedScoreTests(Screen):
    """Looks at effects around a hypothesis, with what was simulated around others of the same motion.

    To which answer an output comes when a law is added depends on the motion, and hardly on how the errors are weighed.
    So what one hypothesis has simulated will do for the next, and only the weighing is its own.
    """

    def __init__(self, hypothesis: Hypothesis, model: DrivelineModel, known: Sequence[Known]) -> None:
        super().__init__(hypothesis.white, model, _Weighted(hypothesis))
        self._known = known
        self.found: list[Known] = [{} for _ in self._known]

    def _runner(self, index: int) -> Simulate:
        simulate, known, found_here = super()._runner(index), self._known[index], self.found[index]
        nominal, still = self._result.p_of(index), self._output(index)

        def run(parameters: Sequence[FloatArray], alike_s: FloatArray | None = None) -> FloatArray:
            keys = [_changed(nominal, p) for p in parameters]
            if all(key in known for key in keys):
                return np.array([still + known[key] for key in keys])
            found = simulate(parameters, alike_s)
            found_here.update((key, (out - still).astype(np.float32)) for key, out in zip(keys, found, strict=True))
            return found

        return run


def _changed(nominal: FloatArray, p: FloatArray) -> bytes:
    places = np.flatnonzero(p != nominal)
    return places.tobytes() + p[places].tobytes()


def _filled(p: FloatArray, shared: tuple[Shared, ...]) -> FloatArray:
    filled = p.copy()
    for unknown in shared:
        filled[unknown.slot] = unknown.scale * unknown.start
    return filled


def _waved(entry: Effect, release: Release, p: FloatArray) -> list[FloatArray]:
    return small_waves(entry, _filled(p, release.shared), _sizes(release))


def _sizes(release: Release) -> Mapping[str, float]:
    return {unknown.name: unknown.scale * unknown.start for unknown in release.shared}


def _with_own(release: Release, own: tuple[tuple[Shared, ...], ...]) -> Release:
    """Return a release with what recordings have of their own; a further output has that of its recording."""
    return replace(release, own=(*own, *release.own[len(own) :]))


def _with_start(release: Release, unknown: Shared, start: float) -> Release:
    return replace(release, shared=tuple(replace(u, start=start) if u is unknown else u for u in release.shared))


def _at_moments(own: tuple[Shared, ...], record: Record, moments: Moments) -> tuple[Shared, ...]:
    """Return an event's own unknowns at moments, which a fit may move as far as a scan is sure of them."""
    reach, at = cell_s(record), dict(zip(("from_s", "to_s"), moments, strict=True))
    return tuple(
        replace(u, start=at[u.name], low=max(u.low, at[u.name] - reach), high=min(u.high, at[u.name] + reach))
        if u.name in at and moments[0] < moments[1]
        else replace(u, start=u.low, low=u.low, high=u.low)
        for u in own
    )


def _zero(unknown: Shared, null: float) -> float:
    """Return where an unknown does nothing, scaled; a limit does nothing where the data end: at its scale."""
    value = null / unknown.scale
    return value if np.isfinite(value) else 1.0


def _between(own: tuple[Shared, ...], entry: Effect, grid: Cells, stretch: Stretch) -> tuple[Shared, ...]:
    """Return a recording's moments as the scan found them; a fit may move them by a cell: beyond it others match.

    Of an event that is lasting it moves the one at which it changes: the other is the recording's own end.
    """
    rows = {"from_s": stretch.first, "to_s": stretch.last}
    ends = (0, grid.moments_s.size - 1) if entry.lasting else ()
    cell = float(grid.moments_s[1] - grid.moments_s[0]) if stretch.last > stretch.first else 0.0
    found = []
    for unknown in own:
        row = rows[unknown.name]
        at, reach = float(grid.moments_s[row]), 0.0 if row in ends else cell
        found.append(replace(unknown, start=at, low=max(unknown.low, at - reach), high=min(unknown.high, at + reach)))
    return tuple(found)
