"""Hypotheses: sets of effects, fitted once each; and which of the catalogue the recordings can tell."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.diagnosis.hypotheses import NOTHING, Bench, everything, open_hypotheses, with_effect
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.simulate import Start
from tests.estimator.diagnosis.planted import SIGMA, quiet, rubbing
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps

COULOMB = frozenset({"coulomb_friction_motor"})
FRICTION_NM = 12.0


@pytest.fixture(scope="module")
def bench() -> Bench:
    records = rubbing(lambda speed: FRICTION_NM)
    return Bench(model(ONE_MASS), records, everything(records))


def test_an_effect_is_added() -> None:
    assert with_effect(frozenset({"backlash"}), "actuator_lag") == {"backlash", "actuator_lag"}


def test_an_effect_replaces_its_special_cases() -> None:
    assert with_effect(COULOMB | {"backlash"}, "stribeck_friction") == {"backlash", "stribeck_friction"}
    assert with_effect(frozenset({"stribeck_friction"}), "coulomb_friction_motor") == {
        "stribeck_friction",
        "coulomb_friction_motor",
    }


def test_every_sample_that_counts_is_used() -> None:
    records = quiet(seeds=(1,), values=ONE_MASS, samples=300)
    records[0].okay[5] = False
    (use,) = everything(records)
    np.testing.assert_array_equal(use, records[0].okay)


def test_each_set_is_fitted_once(bench: Bench) -> None:
    first = bench.fit(NOTHING)
    assert bench.fit(NOTHING) is first
    assert bench.fit(COULOMB, first) is bench.fit(COULOMB)


def test_the_planted_effect_is_fitted_to_the_noise(bench: Bench) -> None:
    nominal, released = bench.fit(NOTHING), bench.fit(COULOMB, bench.fit(NOTHING))
    assert nominal.rms > 2.0 * SIGMA
    assert released.rms == pytest.approx(SIGMA, rel=0.1)
    assert released.value("coulomb_friction_motor", "friction_nm") == pytest.approx(FRICTION_NM, rel=0.05)


def names_of(result: FitResult) -> list[tuple[str, str]]:
    return [(shared.effect, shared.name) for shared in result.problem.shared]


def test_nominal_parameters_come_first_then_each_effect_by_name(bench: Bench) -> None:
    both = bench.fit(frozenset({"transport_delay", "actuator_lag"}), bench.fit(NOTHING))
    assert names_of(both) == [
        ("", "J_M"),
        ("", "b_M"),
        ("actuator_lag", "time_constant_s"),
        ("transport_delay", "delay_s"),
    ]


def test_a_profile_is_each_recordings_own(bench: Bench) -> None:
    road = bench.fit(frozenset({"road_grade"}), bench.fit(NOTHING))
    assert names_of(road) == names_of(bench.fit(NOTHING))
    assert all(basis.profile.shape[0] > 2 for basis in road.problem.local)
    assert road.rms <= bench.fit(NOTHING).rms


def test_an_effect_that_is_known_starts_where_it_was(bench: Bench) -> None:
    """One start is enough then: as many hypotheses as starts would cost the product."""
    with_friction = bench.fit(COULOMB, bench.fit(NOTHING))
    more = bench.fit(COULOMB | {"actuator_lag"}, with_friction)
    assert more.value("coulomb_friction_motor", "friction_nm") == pytest.approx(FRICTION_NM, rel=0.05)
    assert more.rms <= with_friction.rms * (1.0 + 1e-3)


class TestOpenHypotheses:
    REVERSAL = linear_record(ONE_MASS, random_steps(1000, 1, hold=50), Start(0.0, 0.0, 0.5), sigma=0.01)
    FORWARD = linear_record(ONE_MASS, random_steps(1000, 2), Start(0.0, 0.0, 50.0), sigma=0.01)

    def test_one_mass_has_no_shaft_effects(self) -> None:
        testable, untestable = open_hypotheses(model(ONE_MASS), [self.REVERSAL])
        assert {EFFECTS[name].element for name in testable} == {Element.TORQUE_PATH, Element.MOTOR, Element.LOAD}
        assert untestable == {}

    def test_what_can_not_be_told_is_given_with_its_reason(self) -> None:
        testable, untestable = open_hypotheses(model(ONE_MASS), [self.FORWARD])
        assert set(untestable) == {"coulomb_friction_motor", "stribeck_friction"}
        assert "never changes sign" in untestable["stribeck_friction"].reason
        assert not set(testable) & set(untestable)

    def test_what_the_model_has_is_no_hypothesis(self) -> None:
        having = model(ONE_MASS, effects={"coulomb_friction_motor": {"friction_nm": 3.0}})
        testable, untestable = open_hypotheses(having, [self.REVERSAL])
        assert "coulomb_friction_motor" not in {*testable, *untestable}

    def test_two_masses_have_all(self) -> None:
        rec = linear_record(TWO_MASS, random_steps(1000, 3, hold=50), Start(0.0, 0.0, 0.5, 0.0, 0.5))
        testable, _ = open_hypotheses(model(TWO_MASS), [rec])
        assert set(testable) == set(EFFECTS)
