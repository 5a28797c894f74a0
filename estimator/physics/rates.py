"""How fast the output of a fit changes just before each sample, and just after it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.physics.fit import FitResult
from estimator.physics.model import Structure
from estimator.physics.problem import outputs_at
from estimator.signals.record import FloatArray


def rates(result: FitResult) -> list[FloatArray]:
    """Return the rates of the simulated outputs before and after each sample, shape (2, N) for each recording.

    A torque that steps at a sample makes two of them; what was before the first one is unknown, and taken for what
    follows. A joint follows an imposed motion, which is known at the samples alone: its rates are those of straight
    lines to the neighbours.
    """
    if result.problem.grid.structure is Structure.JOINT:
        pairs = zip(result.outputs, result.problem.records, strict=True)
        return [_secants(output, record.sample_time_s) for output, record in pairs]
    at, before, after = (_sampled(result, periods) for periods in (0.0, -1.0, 1.0))
    return [
        _both_sides(now - was, will_be - now) / record.sample_time_s
        for now, was, will_be, record in zip(at, before, after, result.problem.records, strict=True)
    ]


def _sampled(result: FitResult, periods: float) -> tuple[FloatArray, ...]:
    """Return the outputs, each followed along its tangent for so many sampling periods."""
    problem = result.problem
    moved = [replace(r, offset_s=np.full(r.output.shape, periods * r.sample_time_s)) for r in problem.records]
    return outputs_at(replace(problem, records=tuple(moved)), result.x)


def _secants(output: FloatArray, sample_time_s: float) -> FloatArray:
    steps = np.diff(output) / sample_time_s
    return _both_sides(np.append(0.0, steps), np.append(steps, steps[-1:]))


def _both_sides(before: FloatArray, after: FloatArray) -> FloatArray:
    return np.stack([np.append(after[:1], before[1:]), after])
