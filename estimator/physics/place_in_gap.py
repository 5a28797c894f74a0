"""Where in its gap a joint stood when a recording began: once a fit has left the gap it does not find back.

Beyond the gap the twist at the start only adds to the spring's torque, and the preload makes up for that.
"""

from __future__ import annotations

import numpy as np

from estimator.physics.fit import FitResult
from estimator.physics.kernel import slots
from estimator.physics.laws import beyond_gap
from estimator.physics.model import Structure
from estimator.physics.parallel import concurrently
from estimator.physics.problem import Problem, own_part, simulated_each
from estimator.physics.unknowns import PRELOAD, TWIST
from estimator.signals.record import FloatArray

PLACES = np.linspace(-1.0, 1.0, 9)
"""Where the start is looked for, in halves of the gap."""

WORTH_MOVING = 0.99
"""Squared error of a recording over that at the fit's own place below which another is gone to: a fit finds less."""


def moved(result: FitResult) -> tuple[Problem, FloatArray] | None:
    """Return the problem and its unknowns, (U,), with the start elsewhere in the gap; None where none is better."""
    if result.problem.local[0].structure is not Structure.JOINT or result.p[slots.GAP] <= 0.0:
        return None
    found = concurrently(lambda index: _moved_in(result, index), range(len(result.problem.records)))
    if all(local is None for local in found):
        return None
    x = result.x.copy()
    for index, local in enumerate(found):
        if local is not None:
            x[own_part(result.problem, index)] = local
    return result.problem, x


def _moved_in(result: FitResult, index: int) -> FloatArray | None:
    """Return one recording's unknowns with the start moved; None where it stays."""
    problem, basis, local = result.problem, result.problem.local[index], result.local_of(index)
    p, gap = result.p, result.p[slots.GAP]
    made_up = p[slots.K] * beyond_gap(local[TWIST] * basis.scale[TWIST], gap)
    tried = [local]
    for place in PLACES:
        other = local.copy()
        other[TWIST] = 0.5 * gap * place / basis.scale[TWIST]
        other[PRELOAD] -= made_up / basis.scale[PRELOAD]
        tried.append(other)
    outputs = simulated_each(problem, [(p, x) for x in tried], index)
    use = problem.use[index]
    squares = (((outputs - problem.records[index].output)[:, use]) ** 2).sum(axis=1)
    best = int(squares.argmin())
    return tried[best] if squares[best] < WORTH_MOVING * squares[0] else None
