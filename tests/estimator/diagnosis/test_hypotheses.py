"""Hypotheses: sets of effects, and which of the catalogue the recordings can tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.diagnosis.inference.hypotheses import everything, open_hypotheses, with_effect
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import Start
from estimator.physics.effect import Element
from estimator.physics.model import Motion, Structure
from estimator.signals.record import OutputKind
from tests.estimator.diagnosis.planted import quiet
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps

COULOMB = frozenset({"coulomb_friction_motor"})


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


class TestOpenHypotheses:
    REVERSAL = linear_record(ONE_MASS, random_steps(1000, 1, hold=50), Start(0.0, 0.0, 0.5), sigma=0.01)
    FORWARD = linear_record(ONE_MASS, random_steps(1000, 2), Start(0.0, 0.0, 50.0), sigma=0.01)

    def test_one_mass_has_no_shaft_effects(self) -> None:
        testable, untestable = open_hypotheses(model(ONE_MASS), [self.REVERSAL])
        assert {EFFECTS[name].element for name in testable} == set(Element) - {Element.SHAFT}
        assert all(Structure.ONE_MASS in EFFECTS[name].structures for name in {*testable, *untestable})

    def test_what_can_not_be_tested_is_given_with_its_reason(self) -> None:
        testable, untestable = open_hypotheses(model(ONE_MASS), [self.FORWARD])
        assert set(untestable) >= {"coulomb_friction_motor", "stribeck_friction", "speed_sign_blind"}
        assert "never changes sign" in untestable["stribeck_friction"].reason
        assert not set(testable) & set(untestable)

    def test_what_the_test_was_not_or_the_model_does_not_know_is_no_hypothesis_either(self) -> None:
        """One torque input has no second one to differ from; without a gear ratio a wheel's angle is unknown.

        Of torques of one size any law is a gain.
        """
        _, untestable = open_hypotheses(model(ONE_MASS), [self.REVERSAL])
        assert set(untestable) == {"inverter_gain_mismatch", "load_imbalance", "torque_nonlinearity"}

    def test_what_the_model_has_is_no_hypothesis(self) -> None:
        having = model(ONE_MASS, effects={"coulomb_friction_motor": {"friction_nm": 3.0}})
        testable, untestable = open_hypotheses(having, [self.REVERSAL])
        assert "coulomb_friction_motor" not in {*testable, *untestable}

    def test_two_masses_with_two_torques_have_all_that_is_fitted(self) -> None:
        """What is recognised in the readings is no hypothesis about the line."""
        rec = linear_record(TWO_MASS, random_steps(1000, 3, hold=50), Start(0.0, 0.0, 0.5, 0.0, 0.5))
        other = random_steps(1000, 4, size_nm=30.0)
        shared = replace(rec, torque_nm=np.column_stack([rec.total_torque_nm - other, other]))
        testable, untestable = open_hypotheses(replace(model(TWO_MASS), gear_ratio=5.6), [shared])
        fitted = {name for name, entry in EFFECTS.items() if not entry.recognised}
        assert set(testable) == fitted - {"torque_nonlinearity", "load_imbalance"}
        assert set(untestable) == {"torque_nonlinearity", "load_imbalance"}  # one size of torque, and less than a turn

    def test_a_position_has_no_effects_of_a_speed_sensor(self) -> None:
        angle = linear_record(ONE_MASS, random_steps(1000, 1, hold=50), Start(0.0, 0.0, 0.5), kind=OutputKind.POSITION)
        testable, untestable = open_hypotheses(model(ONE_MASS), [angle])
        assert not {"resolver_error", "speed_filter", "speed_sign_blind"} & {*testable, *untestable}

    def test_where_nothing_turns_nothing_repeats_with_the_turn(self) -> None:
        sliding = model(ONE_MASS, motion=Motion.TRANSLATION)
        testable, untestable = open_hypotheses(sliding, [self.REVERSAL])
        assert not [name for name in {*testable, *untestable} if EFFECTS[name].phases]
