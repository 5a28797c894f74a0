"""The fit finds the truth of an independent linear simulation, and its machinery does what it says."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.fit import FitResult, fit, rates, warm_start
from estimator.physics.jacobian import jacobian_at
from estimator.physics.layout import slot
from estimator.physics.model import DrivelineModel
from estimator.physics.problem import (
    BAD,
    Problem,
    bounds,
    local_part,
    make_problem,
    outputs_at,
    parameters,
    residual_at,
    start_of,
    start_vector,
)
from estimator.physics.unknowns import Shared, effect_unknowns, nominal_unknowns
from estimator.signals.record import Location, OutputKind, Record
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps, scaled

SIGMA = 0.05
STARTS = {
    "first": InitialCondition(30.0, 0.0, 10.0, 0.01, 9.0),
    "second": InitialCondition(-20.0, 0.0, -4.0, -0.005, -4.0),
}
TRUE = scaled(TWO_MASS, J_M=1.08, J_L=0.93, k=1.07, c=0.9, b_M=1.1, b_L=0.95)


def recordings(
    values: Mapping[str, float] = TRUE, samples: int = 1200, **options: OutputKind | Location
) -> list[Record]:
    return [
        linear_record(values, random_steps(samples, seed), start, sigma=SIGMA, seed=seed, name=name, **options)
        for seed, (name, start) in enumerate(STARTS.items(), start=1)
    ]


def nominal_problem(records: list[Record], values: Mapping[str, float] = TWO_MASS) -> Problem:
    line = model(values)
    return make_problem(line, records, nominal_unknowns(line))


class TestRecovery:
    @pytest.mark.parametrize(
        "options",
        [{}, {"location": Location.LOAD}, {"kind": OutputKind.POSITION}],
        ids=["speed", "load_speed", "position"],
    )
    def test_parameters_of_two_masses_within_four_standard_errors(
        self, options: dict[str, OutputKind | Location]
    ) -> None:
        records = recordings(**options)
        result = fit(nominal_problem(records))
        assert result.converged
        assert result.rms == pytest.approx(SIGMA, rel=0.04)  # 2400 samples: 1.4 % standard error
        errors = SIGMA * np.sqrt(np.diag(np.linalg.inv(result.jacobian.T @ result.jacobian)))
        for i, shared in enumerate(result.problem.shared):
            assert abs(result.x[i] * shared.scale - TRUE[shared.name]) < 4.0 * errors[i] * shared.scale
            assert result.value("", shared.name) == result.x[i] * shared.scale

    def test_a_parameter_ends_at_the_edge_of_its_tolerance_and_is_reported_pinned(self) -> None:
        true = scaled(TWO_MASS, J_L=1.5)
        result = fit(nominal_problem(recordings(true)))
        names = [shared.name for shared in result.problem.shared]
        assert result.value("", "J_L") == pytest.approx(1.2 * TWO_MASS["J_L"])
        assert result.pinned[names.index("J_L")]
        assert not result.pinned[names.index("k")]
        assert not result.pinned[len(names) :].any()


class TestJacobian:
    def test_it_agrees_with_central_differences(self) -> None:
        problem = nominal_problem(recordings(samples=300))
        x = start_vector(problem) * 1.01
        jacobian = jacobian_at(problem, x, outputs_at(problem, x))
        step = 1e-4
        for j, unit in enumerate(np.eye(x.size)):
            ahead = residual_at(problem, outputs_at(problem, x + step * unit))
            behind = residual_at(problem, outputs_at(problem, x - step * unit))
            central = (ahead - behind) / (2 * step)
            assert np.max(np.abs(jacobian[:, j] - central)) < 2e-3 * np.max(np.abs(central))

    def test_at_the_upper_bound_the_difference_is_taken_inwards(self) -> None:
        """Within a period the output is linear in a delay but for the decay; in the next with another slope."""
        rec = linear_record(ONE_MASS, random_steps(300, 8, hold=2), InitialCondition(0.0, 0.0, 0.0))
        delay = (Shared("transport_delay", "delay_s", 0.01, 0.0, 1.0, 1.0),)
        problem = make_problem(model(ONE_MASS), [rec], delay)
        at_bound = start_vector(problem)
        assert at_bound[0] == bounds(problem)[1][0]
        inside, beyond = at_bound.copy(), at_bound.copy()
        inside[0], beyond[0] = 0.0, 2.0
        here, back, ahead = (residual_at(problem, outputs_at(problem, x)) for x in (at_bound, inside, beyond))
        column = jacobian_at(problem, at_bound, outputs_at(problem, at_bound))[:, 0]
        decay = ONE_MASS["b_M"] / ONE_MASS["J_M"] * rec.sample_time_s
        largest = np.max(np.abs(column))
        np.testing.assert_allclose(column, here - back, atol=decay * largest)
        assert np.max(np.abs(column - (ahead - here))) > 0.01 * largest > 2.0 * decay * largest


class TestMasks:
    def test_what_a_masked_sample_holds_does_not_matter(self) -> None:
        clean = recordings(samples=600)
        rng = np.random.default_rng(3)
        masked, spoilt = [], []
        for rec in clean:
            okay = rng.random(600) > 0.2
            output = np.where(okay, rec.output, rng.choice([np.nan, 1e6, -3.0], size=600))
            masked.append(replace(rec, okay=okay))
            spoilt.append(replace(rec, okay=okay, output=output))
        results = [fit(nominal_problem(records)) for records in (masked, spoilt)]
        np.testing.assert_array_equal(results[0].x, results[1].x)
        assert results[0].residual.size == sum(int(rec.okay.sum()) for rec in masked)

    def test_a_fit_sees_only_the_samples_it_may_use(self) -> None:
        records = recordings(samples=600)
        line = model(TWO_MASS)
        use = [np.arange(600) < 400 for _ in records]
        changed = [
            replace(rec, output=np.where(seen, rec.output, -rec.output)) for rec, seen in zip(records, use, strict=True)
        ]
        grid = nominal_problem(records).grid
        problems = [make_problem(line, recs, nominal_unknowns(line), use=use, grid=grid) for recs in (records, changed)]
        start = start_vector(problems[0])
        np.testing.assert_array_equal(
            fit(problems[0], start).residual, fit(replace(problems[1], local=problems[0].local), start).residual
        )


class TestRunaway:
    """A stiffness that explodes with twist: the integration overflows."""

    @staticmethod
    def explosive(start: float) -> tuple[Shared, ...]:
        return (Shared("stiffness_nonlinearity", "hardening_per_rad2", 1e9, 0.0, 1.0, start),)

    def test_it_counts_as_very_wrong_but_finite(self) -> None:
        records = recordings(samples=300)
        problem = make_problem(model(TWO_MASS), records, self.explosive(1.0))
        x = start_vector(problem)
        outputs = outputs_at(problem, x)
        assert all(np.isfinite(out).all() for out in outputs)
        assert max(np.max(np.abs(out)) for out in outputs) == BAD * np.abs(records[0].output).max()

    def test_a_fit_keeps_away_from_it(self) -> None:
        records = recordings(samples=300)
        result = fit(make_problem(model(TRUE), records, self.explosive(1e-12)))
        assert result.rms == pytest.approx(SIGMA, rel=0.1)


def test_a_warm_start_begins_where_the_last_fit_ended() -> None:
    records = recordings()
    line = model(TWO_MASS)
    warm = fit(nominal_problem(records))
    delay = effect_unknowns("transport_delay", line, records)[0].shared
    problem = make_problem(line, records, (*nominal_unknowns(line), *delay), profile=True)
    x = warm_start(problem, warm)
    p = parameters(problem, x)
    for shared in warm.problem.shared:
        assert p[shared.slot] == pytest.approx(warm.value("", shared.name))
    assert p[slot("transport_delay", "delay_s")] == delay[0].start * delay[0].scale
    for i in range(2):
        assert start_of(problem, x, i) == start_of(warm.problem, warm.x, i)
        assert not problem.local[i].extra_load(local_part(problem, x, i)).any()


TORQUE_NM = random_steps(400, 1)
START = InitialCondition(5.0, 0.0, 20.0)


def fitted(record: Record, line: DrivelineModel) -> FitResult:
    return fit(make_problem(line, [record], nominal_unknowns(line)))


def test_of_one_mass_the_acceleration_before_and_after_a_torque_steps() -> None:
    """Newton's law with the torque that was, and with the one that comes; within a sub-step's share of J / b = 5 s."""
    line = model(ONE_MASS, tolerance=0.0)
    found = fitted(linear_record(ONE_MASS, TORQUE_NM, START), line)
    ((before, after),) = rates(found)
    drag = ONE_MASS["b_M"] * found.outputs[0] + START.load_torque_nm
    assert after == pytest.approx((TORQUE_NM - drag) / ONE_MASS["J_M"], rel=2e-3)
    was = np.append(TORQUE_NM[0], TORQUE_NM[:-1])
    assert before == pytest.approx((was - drag) / ONE_MASS["J_M"], rel=2e-3)
