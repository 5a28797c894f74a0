"""Derivatives of recordings that fill the kernel's lanes together are those of each by itself."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.lanes import LANES
from estimator.physics import simulate as simulate_module, simulate as together_module
from estimator.physics.jacobian import fill_differences, jacobian_at, secants_at
from estimator.physics.layout import Grid
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import Problem, make_problem, outputs_at, own_part, start_vector
from estimator.physics.unknowns import Shared, effect_unknowns, nominal_unknowns, own_unknowns
from estimator.signals.record import FloatArray, Record
from tests.estimator.physics.bench import TWO_MASS, model, random_steps, record

STEPS = np.array([1e-5, -1e-5])


@pytest.fixture
def output() -> np.ndarray:
    return np.random.default_rng(1).standard_normal(50)


def of_one_recording(
    moved: np.ndarray, output: np.ndarray, use: np.ndarray, limit: float = 1e3, least: float = 0.0
) -> np.ndarray:
    """Return the derivatives by two unknowns of the samples that count, a row each."""
    found = np.zeros((2, int(use.sum())))
    both, one = np.arange(2), np.zeros((2, 1), dtype=int)
    limits, leasts, begins = np.array([limit]), np.array([least]), np.array([0, use.sum()])
    fill_differences(
        moved[:, np.newaxis], one, output[np.newaxis], use[np.newaxis], STEPS, limits, leasts, both, begins, found
    )
    return found


@pytest.mark.parametrize(("ran_to", "stays_at"), [(np.nan, 7.0), (np.inf, 7.0), (-np.inf, -7.0), (9.0, 7.0)])
def test_what_has_run_away_stays_far_away(output: np.ndarray, ran_to: float, stays_at: float) -> None:
    moved = np.stack([output, output])
    moved[1, 20:] = ran_to
    found = of_one_recording(moved, output, np.ones(50, dtype=bool), limit=7.0)
    np.testing.assert_array_equal(found[0], 0.0)
    np.testing.assert_array_equal(found[1, 20:], (stays_at - output[20:]) / STEPS[1])


def test_a_change_by_rounding_alone_is_none(output: np.ndarray) -> None:
    moved = np.stack([output, output])
    moved[0, 3] += 1e-9
    moved[1, 3] += 3e-9
    found = of_one_recording(moved, output, np.ones(50, dtype=bool), least=2e-9)
    np.testing.assert_array_equal(found[0], 0.0)
    assert found[1, 3] == pytest.approx(3e-9 / STEPS[1], rel=1e-5)


def test_each_recording_has_its_own_samples_limit_and_place(output: np.ndarray) -> None:
    """The second is shorter: behind its end nothing counts, whatever stands there."""
    outputs = np.stack([output, output[::-1]])
    use = np.stack([np.arange(50) > 1, np.arange(50) < 20])
    moved = np.full((2, 50), 5e-5) + outputs[::-1]
    moved[0, 20:] = np.nan
    found = np.zeros((3, 68))
    of, columns = np.array([[1], [0]]), np.array([2, 0])
    limits, least = np.array([1e3, 0.5]), np.zeros(2)
    fill_differences(
        moved[:, np.newaxis], of, outputs, use, STEPS, limits, least, columns, np.array([0, 48, 68]), found
    )
    np.testing.assert_array_equal(found[0, :48], (moved[1] - output)[2:] / STEPS[1])
    np.testing.assert_array_equal(found[2, 48:], (np.clip(moved[0], -0.5, 0.5) - output[::-1])[:20] / STEPS[0])
    assert not found[1].any()
    assert not found[0, 48:].any()
    assert not found[2, :48].any()


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


def test_a_slope_over_a_width_is_the_difference_of_two_runs_over_it() -> None:
    problem = problem_of(model(TWO_MASS, effects=GAP), recordings(300, 300))
    x = start_vector(problem)
    outputs = outputs_at(problem, x)
    widths = np.full(x.size, 2e-3)
    found = secants_at(problem, x, outputs, widths)
    for column in (0, 2):
        step = widths[column] * np.eye(x.size)[column]
        up, down = outputs_at(problem, x + step), outputs_at(problem, x - step)
        expected = np.concatenate([(a - b)[use] for a, b, use in zip(up, down, problem.use, strict=True)]) / 4e-3
        np.testing.assert_allclose(found[:, column], expected, atol=1e-9 * np.abs(expected).max())


def test_a_bound_cuts_a_side_off() -> None:
    problem = problem_of(model(TWO_MASS, effects=GAP), recordings(300))
    x = start_vector(problem)
    x[0] = problem.shared[0].high
    outputs = outputs_at(problem, x)
    found = secants_at(problem, x, outputs, np.full(x.size, 2e-3))
    (down,) = outputs_at(problem, x - 2e-3 * np.eye(x.size)[0])
    expected = (outputs[0] - down)[problem.use[0]] / 2e-3
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-9 * np.abs(expected).max())


def test_what_is_held_at_infinity_has_no_slope() -> None:
    """A limit of both inverters' sum leaves theirs where there is none."""
    line, records = model(TWO_MASS), recordings(300)
    releases = effect_unknowns("torque_saturation", line, records)
    problem = next(p for p in (make_problem(line, records, each.shared) for each in releases) if not finite(p).all())
    x = start_vector(problem)
    found = secants_at(problem, x, outputs_at(problem, x), np.full(x.size, 2e-3))
    np.testing.assert_array_equal(found[:, ~finite(problem)], 0.0)
    assert found[:, finite(problem)].any()


def finite(problem: Problem) -> np.ndarray:
    return np.isfinite(start_vector(problem))
