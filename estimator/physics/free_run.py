"""A model on a recording: only the load torque and the initial state are estimated, everything else is the model's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.curve import span
from estimator.physics.driveline import Case, InitialCondition
from estimator.physics.fit import FitResult, fit
from estimator.physics.layout import LOAD, Grid, slot
from estimator.physics.model import DrivelineModel
from estimator.physics.own_scan import Projector, cells, scan, waves
from estimator.physics.problem import Problem, case_of, far_away, make_problem, start_of, start_vector
from estimator.physics.simulate import simulate_each
from estimator.physics.table_signals import beyond_knots
from estimator.physics.tables import COUNT, PREFIX, TABLES
from estimator.physics.unknowns import own_unknowns
from estimator.signals.record import BoolArray, FloatArray, Record, separated_outputs

Own = Mapping[tuple[str, str], float]
"""Effect and parameter to a recording's own value."""

ANGLE = f"{PREFIX}load_angle"

NOTHING_KNOWN: Own = MappingProxyType({})

TURNS = 8  # places of a period from which the phase of a curve over the angle is fitted


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A free-run simulation of one recording."""

    output: FloatArray  # (N,): simulated output, in the unit of the recording's
    rms: float  # RMS of its error over the good samples
    start: InitialCondition  # load torque and initial state that were estimated
    further: tuple[FloatArray, ...] = ()  # (N,)
    beyond: tuple[str, ...] = ()  # sentences on curves beyond whose knots it went, and on a run that ran away


def free_run(model: DrivelineModel, record: Record, known: Own = NOTHING_KNOWN) -> FreeRun:
    """Simulate one recording with a model from its measured torques."""
    profile = any(EFFECTS[name].profile for name in model.effects)
    problem = make_problem(model, [record], (), profile=profile)
    result = settle(problem, known)
    start = start_of(problem, result.x, 0)
    whole = replace(start, load_torque_nm=start.load_torque_nm + float(problem.p[slot("", LOAD)]))
    case = case_of(problem.local[0], problem.p, result.x)
    views = separated_outputs([record], lambda _: 1.0)[1:]
    further = tuple(simulate_each(problem.grid, view, [case])[0] for view in views)
    beyond = beyond_knots(model.effects, problem.grid, record, case, model.motion) if model.plant is None else ()
    said = (*beyond, *ran_away(result.outputs[0], record, model.effects))
    return FreeRun(result.outputs[0], result.rms, whole, further, said)


def ran_away(output: FloatArray, record: Record, effects: Iterable[str]) -> tuple[str, ...]:
    """Return a sentence on a simulated output, shape (N,), that was held where it ran away; none where it did not."""
    gone = np.abs(output) >= far_away(record)
    if not gone.any():
        return ()
    at_s, most = float(record.time_s[np.argmax(gone)]), float(np.abs(output).max())
    suspects = "".join(f", {name}" for name in effects)
    return (
        f"{record.name}: the simulation runs away and is held at ±{most:.4g} from {at_s:.4g} s on: its numbers mean "
        f"nothing. Check the model's values (parameters{suspects}): one is so large, stiff, steep or fast that no "
        "step can follow it.",
    )


def settle(problem: Problem, known: Own = NOTHING_KNOWN) -> FitResult:
    """Estimate what is its own in a problem of one recording without shared unknowns."""
    start = _with_own(problem, known) if problem.local[0].own else start_vector(problem)
    twist, gap_rad = problem.local[0].twist_index, float(problem.p[slot("backlash", "gap_rad")])
    starts = [start]
    if twist is not None and gap_rad > 0.0:
        for side in (-0.5, -0.25, 0.25, 0.5):
            starts.append(start.copy())
            starts[-1][twist] += side * gap_rad / problem.local[0].scale[twist]
    starts = [turned for start in starts for turned in _turned(problem, start)]
    results = [fit(problem, x0) for x0 in starts]
    return min(results, key=lambda result: result.rms)


def _turned(problem: Problem, x: FloatArray) -> list[FloatArray]:
    """Return starts all around where a curve over the angle may begin in a recording; the one given without one."""
    basis = problem.local[0]
    row = next((i for i, own in enumerate(basis.own, basis.own_rows.start) if own.effect == ANGLE), None)
    if row is None:
        return [x]
    first, end = span(problem.p, slot(ANGLE, COUNT))
    starts = [x.copy() for _ in range(TURNS)]
    for i, start in enumerate(starts):
        start[row] = i * (end - first) / TURNS
    return starts


def _with_own(problem: Problem, known: Own) -> FloatArray:
    """Return a start with phases and moments found by a scan around the fit without their effects."""
    basis, record, use = problem.local[0], problem.records[0], problem.use[0]
    sought = {u.effect for u in basis.own if EFFECTS[u.effect].event or EFFECTS[u.effect].phases}
    names = sorted(sought - {effect for effect, _ in known} - {*TABLES})
    sizes = {name: _sizes(problem.p, name) for name in names}
    silent = problem.p.copy()
    for name in names:
        for parameter in sizes[name]:
            silent[slot(name, parameter)] = 0.0
    still = fit(replace(problem, p=silent))
    rest = Projector(still)
    begin, extra = start_of(still.problem, still.x, 0), basis.extra_load(still.x)

    def run(parameters: Sequence[FloatArray], alike_s: FloatArray | None = None) -> FloatArray:
        cases = [Case(p, begin, extra) for p in parameters]
        return simulate_each(problem.grid, record, cases, alike_s=alike_s)[:, use]

    found = dict(known)
    for name in names:
        entry = EFFECTS[name]
        alone = silent.copy()
        for parameter, size in sizes[name].items():
            alone[slot(name, parameter)] = size
        if entry.event:
            grid = cells(entry, alone, basis.own, sizes[name], run)
            size = next(iter(sizes[name].values()))
            stretch = scan(rest.rest(grid.answers), rest.error, entry.lasting).best(size)
            found[name, "from_s"] = float(grid.moments_s[stretch.first])
            found[name, "to_s"] = float(grid.moments_s[stretch.last])
            continue
        for wave in waves(entry, alone, sizes[name], run, still.outputs[0][use]):
            along, across = -np.linalg.lstsq(rest.rest(wave.answers).T, rest.error, rcond=None)[0]
            found[name, wave.phase] = float(np.arctan2(across, along))
    x = still.x.copy()
    x[basis.own_rows] = [found.get((unknown.effect, unknown.name), unknown.start) for unknown in basis.own]
    return x


def _sizes(p: FloatArray, name: str) -> dict[str, float]:
    """Return the sizes of an effect whose phases or moments are sought: its amplitudes, or what an event changes."""
    return {parameter: float(p[slot(name, parameter)]) for parameter in EFFECTS[name].sizes}


def simulate_foreign(
    model: DrivelineModel,
    p: FloatArray,
    grid: Grid,
    record: Record,
    use: BoolArray,
    effects: Iterable[str] = (),
) -> FloatArray:
    """Simulate a recording with a parameter vector that was fitted to others."""
    names = {*model.effects, *effects}
    profile = any(EFFECTS[name].profile for name in names)
    problem = make_problem(
        model, [record], (), own=[own_unknowns(names, record)], profile=profile, use=[use], grid=grid
    )
    return settle(replace(problem, p=p)).outputs[0]
