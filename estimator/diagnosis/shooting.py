"""A fit begun anew in short stretches: the way out of the many small minima of a free run that bounces.

Over a free run of thirty seconds a gap whose size is a little off touches at other moments from the first bounce on,
and the error has a small minimum for every way in which its faces may. Over stretches of a few periods, each with a
state of its own at its start, the error is smooth (multiple shooting: Bock, 1981; for simulation errors Ribeiro et al.,
Automatica 121, 2020). Where the stretches end the whole begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimator.physics.catalogue import EFFECTS
from estimator.physics.fit import FitResult, fit
from estimator.physics.kernel import slots, state_vector
from estimator.physics.model import DrivelineModel, Structure, natural_frequencies_rad_s
from estimator.physics.parallel import concurrently
from estimator.physics.problem import Problem, case_of, own_part, start_of, start_vector
from estimator.physics.simulate import output_state, simulate_each
from estimator.physics.start import Start
from estimator.signals.part import sliced

PERIODS = 8
"""Periods of the line's lowest mode that a stretch has: the error is smooth over a few bounces, and each stretch must
tell its own start."""

LEAST_SAMPLES = 50
"""Samples that count of a stretch: a dozen for each unknown of its own."""

MOST_STRETCHES = 45
"""Stretches of all recordings together, of which each adds unknowns: where there would be more, some are left out."""

ITERATIONS = 20
"""Jacobians of the fit in stretches: it is only gone on from."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """Samples of one recording in a row.

    Attributes
    ----------
    index : int
        Which recording.
    rows : slice
        Which of its samples.
    start : Start
        Load torque, and the state that the line is in when they begin [Nm, rad, rad/s].
    """

    index: int
    rows: slice
    start: Start


def can_be_shot(result: FitResult) -> bool:
    """Tell whether a fit can begin anew in stretches: of a line whose state at a moment is all that its past matters.

    Phases count from a recording's start, and a load profile stands over all of it.
    """
    bases = result.problem.local
    return all(
        basis.twist_index is not None
        and basis.structure is not Structure.JOINT
        and basis.profile.shape[0] == 0
        and not any(EFFECTS[own.effect].phases for own in basis.own)
        for basis in bases
    )


def shot(result: FitResult, model: DrivelineModel) -> FitResult:
    """Fit from where a fit in stretches ends, each begun in a state of its own; a fit that ``can_be_shot``.

    Common unknowns and the state at the beginning are those of the stretches, the load torque is their median.
    """
    parts = stretches(result, model)
    short = _fitted(result, parts)
    x = result.x.copy()
    x[: len(result.problem.shared)] = short.x[: len(result.problem.shared)]
    for i, basis in enumerate(result.problem.local):
        ended = {
            part.rows.start: start_of(short.problem, short.x, k) for k, part in enumerate(parts) if part.index == i
        }
        if 0 in ended:
            load_nm = float(np.median([start.load_torque_nm for start in ended.values()]))
            begun = replace(ended[0], load_torque_nm=load_nm)
            x[own_part(result.problem, i)] = basis.entered(result.local_of(i), begun)
    return fit(result.problem, x)


def stretches(result: FitResult, model: DrivelineModel) -> list[Stretch]:
    """Return the stretches of a fit's recordings that have enough samples that count."""
    records = result.problem.records
    period_s = 2.0 * math.pi / float(natural_frequencies_rad_s(model.values())[0])
    length = max(math.ceil(PERIODS * period_s / records[0].sample_time_s), LEAST_SAMPLES)
    share = min(MOST_STRETCHES * length / sum(record.time_s.size for record in records), 1.0)
    courses = concurrently(lambda i: _course(result, i), range(len(records)))
    parts = []
    for i, (record, use) in enumerate(zip(records, result.problem.use, strict=True)):
        cut = np.array_split(np.arange(record.time_s.size), max(record.time_s.size // length, 1))
        for k in np.linspace(0, len(cut) - 1, max(round(share * len(cut)), 1)).round().astype(int):
            rows = cut[k]
            if use[rows].sum() >= LEAST_SAMPLES:
                parts.append(Stretch(i, slice(int(rows[0]), int(rows[-1]) + 1), courses[i](rows[0])))
    return parts


def _course(result: FitResult, index: int) -> Callable[[int], Start]:
    """Return the state that a recording is in at a row: as the fit has it, but for what is measured."""
    problem, record, load = result.problem, result.problem.records[index], start_of(result.problem, result.x, index)
    case = case_of(problem.local[index], result.p, result.local_of(index))
    seen = (state_vector.ANGLE, state_vector.SPEED, state_vector.TWIST, state_vector.LOAD_SPEED)
    courses = {state: simulate_each(problem.grid, record, [case], state)[0] for state in seen}
    measured = output_state(record, problem.grid.structure)
    courses[measured] = np.where(record.okay, record.output, courses[measured])
    behind = result.p[slots.K] / result.p[slots.K_2] if problem.grid.structure is Structure.THREE_MASS else 0.0

    def at(row: int) -> Start:
        angle, speed, twist, load_speed = (float(courses[state][row]) for state in seen)
        return replace(
            load,
            angle_rad=angle,
            speed_rad_s=speed,
            twist_rad=twist,
            load_speed_rad_s=load_speed,
            middle_twist_rad=behind * twist,
            middle_speed_rad_s=load_speed,
        )

    return at


def _fitted(result: FitResult, parts: Sequence[Stretch]) -> FitResult:
    """Fit in stretches; moments of events stay where they are."""
    whole = result.problem
    bases, records, use = [], [], []
    for k, part in enumerate(parts):
        basis, record = whole.local[part.index], whole.records[part.index]
        records.append(sliced(record, part.rows, f"{record.name}/{k}"))
        use.append(whole.use[part.index][part.rows])
        local = basis.entered(result.local_of(part.index), part.start)
        held = tuple(
            replace(own, low=value, high=value, start=value)
            for own, value in zip(basis.own, local[basis.own_rows].tolist(), strict=True)
        )
        bases.append(replace(basis, guess=local, own=held, profile=np.empty((0, records[-1].time_s.size))))
    problem = Problem(whole.grid, tuple(records), whole.p, whole.shared, tuple(bases), tuple(use))
    x = start_vector(problem)
    x[: len(whole.shared)] = result.x[: len(whole.shared)]
    return fit(problem, x, ITERATIONS)
