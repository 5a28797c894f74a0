"""Shares add up to what is explained; a probability sums over all sets that hold an effect."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import cast

import pytest
from estimator.diagnosis.inference.judge import (
    Score,
    error_falls,
    levels,
    probability_of,
    shares,
    tempered_by,
    verdict_of,
)

from estimator.diagnosis.inference import checks
from estimator.diagnosis.inference.checks import LOOSE, is_plausible, widened
from estimator.diagnosis.inference.disturbances import Limits, limits_for
from estimator.diagnosis.inference.hypotheses import Hypothesis
from estimator.diagnosis.inference.wording import Context, statement
from estimator.diagnosis.result import Effort, Evidence, Fit, FoundEffect, Remainder, Verdict
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, not_fitted
from estimator.physics.problem import make_problem, start_vector
from estimator.physics.unknowns import effect_unknowns, nominal_unknowns
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA


@dataclass
class Left:
    """A set of effects and the squared free-run error that it leaves."""

    effects: frozenset[str] = field(default_factory=frozenset)
    free_squares: float = 0.0


def path(*steps: tuple[str, float]) -> list[Hypothesis]:
    return [cast(Hypothesis, Left(frozenset(names.split()), squares)) for names, squares in steps]


def test_each_effect_has_what_is_left_less_from_where_it_was_added() -> None:
    found = shares(path(("", 100.0), ("lag", 40.0), ("lag brake", 10.0)))
    assert found == pytest.approx({"lag": 0.6, "brake": 0.3})


def test_an_effect_that_takes_anothers_place_has_its_share_too() -> None:
    found = shares(path(("", 100.0), ("lag", 40.0), ("lag brake", 10.0), ("lag payload", 5.0)))
    assert found == pytest.approx({"lag": 0.6, "payload": 0.35})


def test_a_set_leaves_no_more_than_one_that_it_holds() -> None:
    """However poor the least-squares fit of the larger one is: what it does not gain is not shared out either."""
    assert levels(path(("", 100.0), ("lag", 10.0), ("lag brake", 60.0), ("brake", 50.0))) == [100.0, 10.0, 10.0, 50.0]
    assert shares(path(("", 100.0), ("lag", 10.0), ("lag brake", 60.0), ("lag brake slip", 40.0))) == pytest.approx(
        {"lag": 0.9, "brake": 0.0, "slip": 0.0}
    )


def test_a_probability_sums_over_all_sets_that_hold_the_effect_or_a_look_alike() -> None:
    sets = {"": 6.0, "lag": 0.0, "filter": 0.0, "brake lag": 0.0}
    scores = [Score(frozenset(effects.split()), score) for effects, score in sets.items()]
    one = probability_of({"lag"}, scores, 1.0)
    assert one == pytest.approx(2.0 / (3.0 + 0.0498), rel=1e-3)
    assert probability_of({"lag", "filter"}, scores, 1.0) > one
    assert probability_of({"lag", "filter"}, scores, 10.0) < probability_of({"lag", "filter"}, scores, 1.0)


def test_a_set_without_an_effect_counts_against_it_even_with_values_that_are_no_case_of_their_effects() -> None:
    """Something else is there, that neither is: the effect is not needed for it."""
    scores = [Score(frozenset({"lag", "brake"}), 0.0), Score(frozenset({"brake"}), -20.0, is_plausible=False)]
    assert probability_of({"lag"}, scores, 1.0) < 1e-4
    assert probability_of({"brake"}, scores, 1.0) == 1.0


def left_over(value: float, most: float, is_share: bool = True) -> checks.Test:
    return checks.Test("", value, most, is_share)


def test_differences_of_scores_count_by_what_is_left_beyond_what_explained_worlds_leave() -> None:
    """Tests find the same information again: the one that finds most of it counts, the others do not add to it."""
    assert tempered_by([left_over(0.02, 0.03), left_over(50.0, 25.0, is_share=False)], 1000, 4.0) == 4.0
    assert tempered_by([left_over(0.05, 0.03), left_over(0.13, 0.03)], 1000, 4.0) == pytest.approx(104.0)
    assert tempered_by([left_over(0.0301, 0.03)], 1000, 4.0) == pytest.approx(4.1)


@pytest.mark.parametrize(
    ("of_spread", "is_named", "is_more_than_noise", "falls", "expected"),
    [
        (0.1, True, False, True, Verdict.EXPLAINED),
        (0.1, True, True, True, Verdict.PARTLY_EXPLAINED),
        (0.1, True, False, False, Verdict.UNEXPLAINED),
        (0.1, True, True, False, Verdict.UNEXPLAINED),
        (0.1, False, False, True, Verdict.NO_MISMATCH),
        (0.1, False, True, True, Verdict.UNEXPLAINED),
        (1.2, True, True, True, Verdict.UNEXPLAINED),
        (1.2, False, False, True, Verdict.UNEXPLAINED),
    ],
)
def test_nothing_is_explained_that_leaves_as_much_as_the_signal_itself_or_an_error_that_does_not_fall(
    of_spread: float, is_named: bool, is_more_than_noise: bool, falls: bool, expected: Verdict
) -> None:
    assert verdict_of(of_spread, is_named, is_more_than_noise, falls) is expected


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
    assert low == pytest.approx((1.0 - BENCH.model.parameters["b_L"].tolerance) / LOOSE)
    assert is_plausible(at(at_bound, "b_L", 0.2), BENCH.model, BENCH.records)  # 1.2 when cold
    assert not is_plausible(at(at_bound, "b_L", 2.0), BENCH.model, BENCH.records)  # 2 to 3


ERRORS = (0.0499, 0.05, 35.5, 35.50001)
EFFORTS = (Effort(), Effort("quick", 10, False, ("backlash", "gravity"), 40, 1.0))


def effect(name: str, probability: float) -> FoundEffect:
    evidence = Evidence(10.0, 1.0, 0.5, 1e-9)
    return FoundEffect(
        name, Element.SHAFT, f"there is {name}", {}, {}, (), evidence, share=0.9, probability=probability
    )


EFFECTS = ((), (effect("backlash", 0.95),), (effect("backlash", 1.0), effect("stale_samples", math.nan)))


@pytest.mark.parametrize(("effects", "effort", "left"), list(itertools.product(EFFECTS, EFFORTS, (None, 0.0, 1.0))))
def test_a_statement_says_what_its_numbers_say(
    effects: tuple[FoundEffect, ...], effort: Effort, left: float | None
) -> None:
    for errors in itertools.product(ERRORS, repeat=4):
        says_what_its_numbers_say(errors, effects, effort, left)


def says_what_its_numbers_say(
    errors: tuple[float, ...], effects: tuple[FoundEffect, ...], effort: Effort, left: float | None
) -> None:
    retuned, augmented, held_before, held_after = errors
    fit = Fit("rad/s", retuned, retuned, augmented, held_before, held_after, 0.05)
    verdict = verdict_of(0.1, bool(effects), left is not None, error_falls(fit))
    remainder = None if left is None else Remainder(left, 3.0, None, None, "has a line in its spectrum")
    said = statement(verdict, fit, effects, effort, Context(remainder))
    assert said.startswith("Not decided") is not effort.finished
    is_explained = verdict in (Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED)
    assert ("This explains" in said) is (is_explained and effort.finished)
    assert ("Missing in the model" in said) is (is_explained and effort.finished)
    assert "rises" not in said
    for before, after in re.findall(r"falls from (\S+) to (\S+)", said):
        assert float(after) < float(before)
    assert "of the squared error is left" not in said or verdict is Verdict.PARTLY_EXPLAINED
    assert ("Nothing is missing" in said) is (verdict is Verdict.NO_MISMATCH and effort.finished)
    if not effort.finished:
        assert "after 1 s, 2 of 40 effects untried, among them backlash, gravity" in said
