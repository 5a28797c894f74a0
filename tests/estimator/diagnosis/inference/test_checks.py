"""Values that are no case of their effect, and nominal values that an effect changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

from estimator.diagnosis.inference.disturbances import Limits, limits_for
from estimator.diagnosis.inference.fits import widened
from estimator.diagnosis.inference.hypotheses import Hypothesis, is_plausible
from estimator.diagnosis.thresholds import Checks
from estimator.physics.fit import FitResult, not_fitted
from estimator.physics.problem import make_problem, start_vector
from estimator.physics.unknowns import effect_unknowns, nominal_unknowns
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA

BENCH = bench_with("warming_friction", {"cold_nm_s": 1.0, "time_constant_s": 5.0})
LIMITS: Limits = limits_for(BENCH.records, SIGMA)


def hypothesis_with(values: Mapping[str, Mapping[str, float]]) -> Hypothesis:
    releases = {name: effect_unknowns(name, BENCH.model, BENCH.records)[0] for name in values}
    shared = [*nominal_unknowns(BENCH.model), *(each for release in releases.values() for each in release.shared)]
    own = [tuple(each for r in releases.values() for each in r.own[i]) for i in range(len(BENCH.records))]
    problem = make_problem(BENCH.model, BENCH.records, shared, own=own)
    x = start_vector(problem)
    for i, each in enumerate(problem.shared):
        if each.name in values.get(each.effect, {}):
            x[i] = values[each.effect][each.name] / each.scale
    return Hypothesis(frozenset(values), not_fitted(problem, x), LIMITS.usual, LIMITS, 0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "values", "expected"),
    [
        ("actuator_lag", {"time_constant_s": 0.02}, True),
        ("actuator_lag", {"time_constant_s": 0.4}, False),  # no current loop
        ("transport_delay", {"delay_s": 0.3}, False),  # no bus
        ("speed_sign_blind", {"share": 0.9}, True),
        ("speed_sign_blind", {"share": 0.1}, False),  # the sign is read
        ("torque_saturation", {"limit_m1_nm": 1.0, "limit_m2_nm": 1.0}, False),  # the input is off
        ("torque_derating", {"depth": 0.99, "time_constant_s": 1.0}, False),  # off in the end
        ("coulomb_friction_motor", {"friction_nm": 1e5}, False),  # above all torque
        ("tyre_slip", {"grip_nm": 1e5, "creep_rad_s": 5.0}, True),  # a limit may be
    ],
)
def test_values_that_are_no_case_of_an_effect(name: str, values: Mapping[str, float], expected: bool) -> None:
    assert is_plausible(hypothesis_with({name: values}), BENCH.model, BENCH.records) is expected


def at(hypothesis: Hypothesis, name: str, x: float) -> Hypothesis:
    plain: FitResult = hypothesis.result
    moved = plain.x.copy()
    moved[next(i for i, each in enumerate(plain.problem.shared) if (each.effect, each.name) == ("", name))] = x
    return replace(hypothesis, result=replace(plain, x=moved))


def test_friction_that_warms_is_described_somewhere_between_cold_and_warm() -> None:
    cold_nm_s = BENCH.model.parameters["b_L"].value
    hypothesis = hypothesis_with({"warming_friction": {"cold_nm_s": cold_nm_s, "time_constant_s": 5.0}})
    at_bound = at(hypothesis, "b_L", 1.0 - BENCH.model.parameters["b_L"].tolerance)
    loose = widened(at_bound, BENCH.model)
    assert loose is not None
    (low,) = [each.low for each in loose.problem.shared if each.name == "b_L"]
    assert low == pytest.approx((1.0 - BENCH.model.parameters["b_L"].tolerance) / Checks.LOOSE)
    assert is_plausible(at(at_bound, "b_L", 0.2), BENCH.model, BENCH.records)  # 1.2 when cold
    assert not is_plausible(at(at_bound, "b_L", 2.0), BENCH.model, BENCH.records)  # 2 to 3
