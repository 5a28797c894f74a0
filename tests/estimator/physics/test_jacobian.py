"""Derivatives of recordings that fill the kernel's lanes together are those of each by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.lanes import LANES
from estimator.physics import simulate as simulate_module
from estimator.physics import simulate as together_module
from estimator.physics.grid import Grid
from estimator.physics.jacobian import changes, jacobian_at
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import Problem, make_problem, outputs_at, own_part, start_vector
from estimator.physics.unknowns import Shared, nominal_unknowns, own_unknowns
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

GAP = {"backlash": {"gap_rad": 0.01, "contact_rad": 5e-4, "pull": 0.3}}
BRAKED = GAP | {"brake_drag": {"brake_nm": 20.0}}
RIPPLE = Shared("torque_ripple", "amplitude_nm", 1.0, 0.0, 10.0, 0.0)
COLD = Shared("warming_friction", "cold_nm_s", 1.0, 0.0, 10.0, 0.0)


def recordings(*sizes: int, apart_s: float = 0.0) -> list[Record]:
    found = []
    for i, size in enumerate(sizes):
        speed = 5.0 + np.random.default_rng(i).standard_normal(size)
        run = record(random_steps(size, seed=i, hold=20), speed, name=f"run_{i}")
        found.append(replace(run, began_s=float(run.time_s[0]) - i * apart_s, okay=np.arange(size) % (7 + i) > 0))
    return found


def problem_of(line: DrivelineModel, records: list[Record], *more: Shared, profile: bool = False) -> Problem:
    own = [own_unknowns(line.effects, run) for run in records]
    return make_problem(
        line, records, (*nominal_unknowns(line), *more), own=own, profile=profile, grid=Grid(line.structure, 4, 0.02)
    )


def by_themselves(problem: Problem, x: FloatArray) -> FloatArray:
    """Put the derivatives of problems of one recording each in their places."""
    blocks = []
    shared = len(problem.shared)
    for i, (run, basis, use) in enumerate(zip(problem.records, problem.local, problem.use, strict=True)):
        alone = replace(problem, records=(run,), local=(basis,), use=(use,), leads=(0,))
        mine = own_part(problem, i)
        mine_x = np.concatenate([x[:shared], x[mine]])
        block = np.zeros((int(use.sum()), x.size))
        derivative = jacobian_at(alone, mine_x, outputs_at(alone, mine_x))
        block[:, :shared], block[:, mine] = derivative[:, :shared], derivative[:, shared:]
        blocks.append(block)
    return np.vstack(blocks)


@pytest.mark.parametrize(
    ("effects", "more", "profile", "sizes", "apart_s", "together"),
    [
        (GAP, (), False, (300, 300, 290), 0.0, True),
        (GAP, (), True, (300, 300), 0.0, True),
        (GAP, (), False, (300,) * (LANES + 3), 2.0, True),
        (BRAKED, (), False, (300, 300), 0.0, True),
        (GAP, (RIPPLE,), False, (300, 300), 0.0, False),
        (GAP, (COLD,), False, (300, 300), 3.0, False),
        (GAP, (COLD,), False, (300, 300), 0.0, True),
        (GAP, (), False, (300, 120), 0.0, False),
        ({}, (), False, (300, 300), 0.0, False),
    ],
    ids=[
        "three",
        "under load profiles",
        "more than lanes, begun at other times",
        "with moments of their own",
        "a wave of no size yet",
        "what depends on the time, begun at other times",
        "what depends on the time",
        "of other lengths",
        "linear",
    ],
)
def test_derivatives_are_those_of_each_recording_by_itself(
    effects: dict[str, dict[str, float]],
    more: tuple[Shared, ...],
    profile: bool,
    sizes: tuple[int, ...],
    apart_s: float,
    together: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = problem_of(model(TWO_MASS, effects=effects), recordings(*sizes, apart_s=apart_s), *more, profile=profile)
    x = start_vector(problem)
    outputs = outputs_at(problem, x)
    widths = []
    given = simulate_module.inputs_of

    def noted(records: list[Record], of: list[int], cases: list[object]) -> object:
        widths.append(len(set(of)))
        return given(records, of, cases)

    for module in (simulate_module, together_module):
        monkeypatch.setattr(module, "inputs_of", noted)
    found = jacobian_at(problem, x, outputs)
    assert (max(widths) > 1) is together
    alone = by_themselves(problem, x)
    size = np.abs(alone).max(axis=0)
    assert (size > 0.0).sum() >= x.size - 2 * len(sizes)  # a moment that is nowhere moves nothing
    assert (np.abs(found - alone) <= 1e-5 * size + 1e-6).all()  # rounding, of outputs of some rad/s over the step


def test_changes_are_the_columns_of_one_recording() -> None:
    problem = problem_of(model(TWO_MASS, effects=GAP), recordings(300, 280, 290))
    x = start_vector(problem)
    outputs, columns = outputs_at(problem, x), np.array([2, 0, own_part(problem, 1).start])
    rows = slice(int(problem.use[0].sum()), int(problem.use[0].sum() + problem.use[1].sum()))
    found = changes(problem, x, 1, columns, outputs)
    np.testing.assert_allclose(found, jacobian_at(problem, x, outputs)[rows, columns], atol=1e-6 * np.abs(found).max())
