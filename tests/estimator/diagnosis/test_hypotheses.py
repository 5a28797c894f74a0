"""Hypotheses: sets of effects, and which of the catalogue the recordings can tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.diagnosis.inference.fits import with_effect
from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.physics.catalogue import EFFECTS
from estimator.physics.driveline import InitialCondition
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model, random_steps

COULOMB = frozenset({"coulomb_friction_motor"})


def test_an_effect_replaces_its_special_cases() -> None:
    assert with_effect(COULOMB | {"backlash"}, "stribeck_friction") == {"backlash", "stribeck_friction"}
    assert with_effect(frozenset({"stribeck_friction"}), "coulomb_friction_motor") == {
        "stribeck_friction",
        "coulomb_friction_motor",
    }


class TestOpenHypotheses:
    REVERSAL = linear_record(ONE_MASS, random_steps(1000, 1, hold=50), InitialCondition(0.0, 0.0, 0.5), sigma=0.01)
    FORWARD = linear_record(ONE_MASS, random_steps(1000, 2), InitialCondition(0.0, 0.0, 50.0), sigma=0.01)

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
        assert set(untestable) == {"load_imbalance", "torque_nonlinearity"}

    def test_what_the_model_has_is_no_hypothesis(self) -> None:
        having = model(ONE_MASS, effects={"coulomb_friction_motor": {"friction_nm": 3.0}})
        testable, untestable = open_hypotheses(having, [self.REVERSAL])
        assert "coulomb_friction_motor" not in {*testable, *untestable}

    def test_two_masses_with_two_torques_have_all_that_is_fitted(self) -> None:
        """What is recognised in the readings is no hypothesis about the line."""
        rec = linear_record(TWO_MASS, random_steps(1000, 3, hold=50), InitialCondition(0.0, 0.0, 0.5, 0.0, 0.5))
        other = random_steps(1000, 4, size_nm=30.0)
        shared = replace(rec, torque_nm=np.column_stack([rec.total_torque_nm - other, other]))
        testable, untestable = open_hypotheses(replace(model(TWO_MASS), gear_ratio=5.6), [shared])
        fitted = {name for name, entry in EFFECTS.items() if not entry.recognised}
        assert set(testable) == fitted - {"torque_nonlinearity", "load_imbalance"}
        assert set(untestable) == {"torque_nonlinearity", "load_imbalance"}  # one size of torque, and less than a turn
