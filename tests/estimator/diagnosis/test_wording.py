"""The words of a verdict: every figure it rests on, where it is, and what to do next."""

from __future__ import annotations

from dataclasses import replace

from estimator.diagnosis.evidence import Gain
from estimator.diagnosis.judgement import Judgement
from estimator.diagnosis.result import Evidence, Fit, FoundEffect, UntestableEffect, Verdict
from estimator.diagnosis.selection import Selection
from estimator.diagnosis.trial import Trial
from estimator.diagnosis.unnamed import UnnamedLaw
from estimator.diagnosis.wording import rejection, statement
from estimator.physics.effect import Element
from tests.estimator.diagnosis.outcome import outcome
from tests.estimator.diagnosis.regression import of_rms

FIT = Fit("rad/s", 0.61, 0.4321, 0.0523, 0.4444, 0.0555, 0.0501)
GAIN = Gain(123.0, 1e-9, 500.0)
LAW = UnnamedLaw(Element.MOTOR, (("sign(w_M)", 3.456), ("w_M |w_M|", -0.01234)), GAIN, 0.05)


def effect(name: str, sentence: str, twins: tuple[str, ...] = ()) -> FoundEffect:
    return FoundEffect(name, Element.SHAFT, sentence, {}, {}, twins, Evidence(1.0, 1.0, 1.0, 0.0))


def test_nothing_missing_gives_error_and_floor() -> None:
    said = statement(Judgement(Verdict.NO_MISMATCH, None, None), (), FIT, ())
    assert said.startswith("Nothing is missing")
    assert "0.432 rad/s" in said
    assert "floor 0.0501 rad/s" in said


def test_an_explanation_gives_before_and_after_seen_and_unseen() -> None:
    judged = Judgement(Verdict.EXPLAINED, LAW, None)
    said = statement(judged, [effect("backlash", "the shaft has a backlash of 0.02 rad in total")], FIT, ())
    assert "leaves out this: the shaft has a backlash of 0.02 rad in total. With it the free-run error falls" in said
    assert "from 0.432 to 0.0523 rad/s" in said
    assert "from 0.444 to 0.0555 rad/s" in said
    assert "remainder" not in said


def test_two_effects_are_these() -> None:
    said = statement(Judgement(Verdict.EXPLAINED, None, None), [effect("a", "one"), effect("b", "two")], FIT, ())
    assert "leaves out these: one; two. With them the free-run error falls" in said


def test_a_remainder_is_given_as_a_law_at_its_place() -> None:
    said = statement(Judgement(Verdict.EXPLAINED, None, LAW), [effect("a", "one")], FIT, ())
    assert "remainder still follows 3.46 sign(w_M) - 0.0123 w_M |w_M| at the motor side" in said


def test_twins_are_named() -> None:
    said = statement(Judgement(Verdict.EXPLAINED, None, None), [effect("a", "one", ("speed_filter",))], FIT, ())
    assert "From torque and speed alone this can't be told from speed_filter." in said


def test_what_is_unexplained_is_located_and_its_objection_given() -> None:
    judged = Judgement(Verdict.UNEXPLAINED, LAW, None, "lag of the torque would leave most of it")
    said = statement(judged, (), FIT, ())
    assert "no entry of the catalogue explains" in said
    assert "leaves 0.432 rad/s against a noise floor of 0.0501 rad/s" in said
    assert "looks most like 3.46 sign(w_M)" in said
    assert said.endswith("at the motor side. Lag of the torque would leave most of it.")


def test_without_a_law_no_place_is_claimed() -> None:
    said = statement(Judgement(Verdict.UNEXPLAINED, None, None), (), FIT, ())
    assert "looks most like" not in said


def test_a_long_law_is_cut_at_three_terms() -> None:
    long = replace(LAW, terms=tuple((f"term {i}", 1.0) for i in range(5)))
    said = statement(Judgement(Verdict.UNEXPLAINED, long, None), (), FIT, ())
    assert "1 term 2 at the" in said
    assert "term 3" not in said


def test_what_can_not_be_told_names_the_test_that_would() -> None:
    blind = (
        UntestableEffect("coulomb_friction_motor", "no reversal", "reversal"),
        UntestableEffect("road_grade", "too short", "cruise"),
        UntestableEffect("stribeck_friction", "no reversal", "reversal"),
    )
    said = statement(Judgement(Verdict.NO_MISMATCH, None, None), (), FIT, blind)
    assert "can't tell coulomb_friction_motor, road_grade, stribeck_friction; a cruise or reversal test would." in said


def test_what_no_test_would_tell_names_what_is_to_be_given() -> None:
    needy = UntestableEffect("load_imbalance", "no gear ratio", "reversal", needs="gear_ratio in [geometry]")
    said = statement(Judgement(Verdict.NO_MISMATCH, None, None), (), FIT, (needy,))
    assert said.endswith("Without gear_ratio in [geometry], load_imbalance can't be told.")
    assert "test would" not in said


class TestRejection:
    RETUNED, BEST = of_rms(1.0, 2), of_rms(0.1, 3)

    def trial(self, name: str, rms: float, failed: str | None = None) -> Trial:
        return Trial(name, frozenset({name}), of_rms(rms, 3), GAIN, None, 0.0, failed)

    def chosen(self, *names: str) -> Selection:
        return outcome(self.RETUNED, frozenset(names), self.BEST if names else self.RETUNED)

    def test_a_failed_test_is_the_reason(self) -> None:
        assert (
            rejection(self.trial("backlash", 0.5, "could be chance"), self.chosen("actuator_lag")) == "could be chance"
        )

    def test_a_rival_is_told_how_much_it_explains(self) -> None:
        """(1 - 0.5^2) / (1 - 0.1^2) = 76 %."""
        said = rejection(self.trial("backlash", 0.5), self.chosen("transport_delay", "actuator_lag"))
        assert said == "explains 76% of what actuator_lag + transport_delay explains"

    def test_one_tried_beside_what_was_chosen_is_told_what_it_adds(self) -> None:
        """(0.1^2 - 0.09^2) / 1 = 0.2 %."""
        effects = frozenset({"actuator_lag", "backlash"})
        trial = Trial("backlash", effects, of_rms(0.09, 4), GAIN, None, 0.0, None)
        said = rejection(trial, self.chosen("actuator_lag"))
        assert said.startswith("beside actuator_lag it removes 0.2% more of the mismatch")

    def test_one_that_makes_things_worse_explains_nothing(self) -> None:
        assert rejection(self.trial("backlash", 1.1), self.chosen("actuator_lag")).startswith("explains 0%")

    def test_a_general_case_adds_too_little(self) -> None:
        said = rejection(self.trial("stribeck_friction", 0.1), self.chosen("coulomb_friction_motor"))
        assert said == "contains coulomb_friction_motor, and its further parameters add too little"

    def test_without_a_choice_it_was_unseen_or_too_small(self) -> None:
        said = rejection(self.trial("backlash", 0.99), self.chosen())
        assert said == "its gain does not show on unseen data or is too small to see"
