"""The verdict: floor, laws without a name, faults of the acquisition, and the objections to chosen effects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.acquisition import Finding
from estimator.diagnosis.bench import Bench
from estimator.diagnosis.evidence import VERY_STRONG, gain, residuals_by_record
from estimator.diagnosis.hypotheses import NOTHING, Effects, everything
from estimator.diagnosis.judgement import ABOVE_FLOOR, judge
from estimator.diagnosis.noise import unpredictable
from estimator.diagnosis.phrases import kind_in_words
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.selection import Selection, survey
from estimator.diagnosis.trial import Trial
from estimator.diagnosis.unnamed import UnnamedLaw, best_unnamed
from estimator.diagnosis.weight import VISIBLE
from estimator.physics.catalogue import EFFECTS
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel
from estimator.physics.start import Start
from estimator.signals.record import OutputKind, Record
from tests.estimator.diagnosis.outcome import outcome
from tests.estimator.diagnosis.planted import SIGMA, TIGHT, drive_torque, quiet, recordings, rubbing
from tests.estimator.diagnosis.regression import of_rms
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model

COULOMB: Effects = frozenset({"coulomb_friction_motor"})
ROAD: Effects = frozenset({"road_grade"})
CUBIC: Effects = frozenset({"stiffness_nonlinearity"})


def selection(records: Sequence[Record], chosen: Effects = NOTHING, line: DrivelineModel | None = None) -> Selection:
    """What a selection that chose these effects hands over."""
    bench = Bench(line or model(ONE_MASS), records, everything(records))
    retuned = bench.fit(NOTHING)
    result = bench.fit(chosen, retuned)
    remaining = survey(result).law if chosen else None
    return outcome(retuned, chosen, result, unnamed=survey(retuned).law, remaining=remaining)


def sensor_error(coefficient: float) -> list[Record]:
    return recordings(Element.SPEED_SENSOR, lambda moved: np.abs(moved.speed), coefficient)


def finding(name: str) -> Finding:
    return Finding(name, {}, {}, 1e-9, "")


class TestNothingChosen:
    def test_at_the_floor_nothing_is_missing(self) -> None:
        verdict = judge(selection(quiet(values=ONE_MASS)), SIGMA)
        assert (verdict.verdict, verdict.unnamed, verdict.objection) == (Verdict.NO_MISMATCH, None, "")

    @pytest.mark.parametrize(("margin", "verdict"), [(0.99, Verdict.UNEXPLAINED), (1.01, Verdict.NO_MISMATCH)])
    def test_above_the_floor_something_is(self, margin: float, verdict: Verdict) -> None:
        chosen = selection(quiet(values=ONE_MASS))
        assert judge(chosen, margin * chosen.retuned.rms / ABOVE_FLOOR).verdict is verdict

    def test_a_position_is_not_measured_against_the_floor(self) -> None:
        """An encoder's noise is far below what any model reaches; only a law can speak against the model."""
        rec = linear_record(ONE_MASS, drive_torque(1), Start(5.0, 0.0, 2.0), sigma=1e-3, kind=OutputKind.POSITION)
        assert judge(selection([rec]), 1e-9).verdict is Verdict.NO_MISMATCH

    def test_a_law_beyond_chance_is_a_mismatch_even_at_the_floor(self) -> None:
        judged = judge(selection(sensor_error(0.03), line=model(TWO_MASS, TIGHT)), 1.0)
        assert judged.verdict is Verdict.UNEXPLAINED
        assert judged.unnamed is not None
        assert judged.unnamed.element is Element.SPEED_SENSOR
        assert judged.unnamed.terms[0][0] == "|w|"

    def test_a_law_too_small_to_see_is_none(self) -> None:
        chosen = selection(sensor_error(0.005), line=model(TWO_MASS, TIGHT))
        law = best_unnamed(chosen.retuned)
        assert law is not None
        assert law.gain.delta_bic > VERY_STRONG
        assert law.rms < chosen.retuned.rms < VISIBLE * law.rms
        assert judge(chosen, SIGMA).verdict is Verdict.NO_MISMATCH


class TestFaultsOfTheAcquisition:
    """They are compensated before: where nothing else is missing, they are what was."""

    def test_alone_they_explain(self) -> None:
        found = selection(quiet(values=ONE_MASS))
        assert judge(found, SIGMA, [finding("stale_samples")]).verdict is Verdict.EXPLAINED
        assert judge(found, SIGMA).verdict is Verdict.NO_MISMATCH

    def test_beside_something_without_a_name_they_do_not(self) -> None:
        found = selection(sensor_error(0.03), line=model(TWO_MASS, TIGHT))
        assert judge(found, SIGMA, [finding("stale_samples")]).verdict is Verdict.UNEXPLAINED

    @pytest.mark.parametrize(
        ("name", "verdict"), [("sample_jitter", Verdict.EXPLAINED), ("stale_samples", Verdict.UNEXPLAINED)]
    )
    def test_only_jitter_leaves_an_error_above_the_floor(self, name: str, verdict: Verdict) -> None:
        """Nothing tells when a sample was taken: what that does to the reading can't be compensated."""
        found = selection(quiet(values=ONE_MASS))
        assert judge(found, 0.9 * found.retuned.rms / ABOVE_FLOOR, [finding(name)]).verdict is verdict


class TestChosen:
    def test_an_effect_that_reaches_the_floor_explains(self) -> None:
        judged = judge(selection(rubbing(lambda speed: 12.0), COULOMB), SIGMA)
        assert (judged.verdict, judged.objection) == (Verdict.EXPLAINED, "")
        assert judged.remaining is None

    def test_one_that_leaves_most_standing_does_not(self) -> None:
        found = selection(rubbing(lambda speed: 12.0), frozenset({"actuator_lag"}))
        judged = judge(found, SIGMA)
        assert judged.verdict is Verdict.UNEXPLAINED
        assert judged.objection.startswith("lag of the torque would leave 100% of the mismatch, ")

    @pytest.mark.parametrize("failed", [None, "its interval includes the value at which it does nothing"])
    def test_one_that_fails_a_test_in_the_last_fit_does_not(self, failed: str | None) -> None:
        found = selection(rubbing(lambda speed: 12.0), COULOMB)
        last = Trial(
            "coulomb_friction_motor", COULOMB, found.result, gain(found.retuned, found.result), None, 0.0, failed
        )
        judged = judge(replace(found, accepted={last.name: last}), SIGMA)
        assert judged.objection == (
            f"dry friction at the motor does not pass in the last fit: {failed}" if failed else ""
        )
        assert judged.verdict is (Verdict.UNEXPLAINED if failed else Verdict.EXPLAINED)

    def test_a_profile_that_leaves_a_law_does_not(self) -> None:
        """A road may follow anything slow; what it leaves of a little dry friction, it does not explain."""
        wave = [replace(rec, output=rec.output + 0.1 * np.sin(0.5 * rec.time_s)) for rec in rubbing(lambda speed: 1.6)]
        judged = judge(selection(wave, ROAD), SIGMA)
        assert judged.verdict is Verdict.UNEXPLAINED
        assert judged.remaining is not None
        assert judged.remaining.element is Element.MOTOR
        law = judged.remaining.terms[0][0]
        assert judged.objection == f"road grade would leave {kind_in_words(law)} at the motor side unexplained"

    @staticmethod
    def nearly(found: Selection, noises: float = 1.14) -> Selection:
        """The same with white errors of so many times the noise left."""
        errors = np.random.default_rng(5).standard_normal(found.retuned.residual.size)
        return replace(found, result=replace(found.result, residual=noises * SIGMA * errors))

    def test_one_elsewhere_that_a_simple_law_beats_does_not(self) -> None:
        """An error of the sensor, nearly explained by the shaft, and to the noise by |w| at the sensor."""
        judged = judge(self.nearly(selection(sensor_error(0.05), CUBIC, model(TWO_MASS, TIGHT))), SIGMA)
        assert judged.verdict is Verdict.UNEXPLAINED
        assert judged.objection == (
            "a law of |w| at the speed reading would explain it with less than hardening or softening shaft"
        )

    @pytest.mark.parametrize(("noises", "unknowns", "believed"), [(1.02, 9, True), (1.02, 0, False), (1.06, 9, False)])
    def test_a_rival_elsewhere_needs_fewer_unknowns_or_a_visibly_smaller_error(
        self, noises: float, unknowns: int, believed: bool
    ) -> None:
        """Of 1.02 times its error a law with more terms is no objection: it takes up details."""
        before, after, best = of_rms(1.0, 2), of_rms(0.1 * noises, 3), of_rms(0.1, 4)
        gained = gain(before, best)
        cheap = gained.n_effective * 2.0 * math.log(1.0 / 0.1) - unknowns * math.log(gained.n_effective)
        rival = UnnamedLaw(Element.TORQUE_PATH, (("a wave", 1.0),), replace(gained, delta_bic=cheap), 0.1)
        found = replace(outcome(before, frozenset({"load_imbalance"}), after), unnamed=rival)
        assert (judge(found, 0.1).objection == "") is believed

    @pytest.mark.parametrize(("tried", "believed"), [(1, True), (30, False)])
    def test_a_name_chosen_among_many_costs_its_choice_as_a_law_does(self, tried: int, believed: bool) -> None:
        """One unknown each; the law was chosen among 15, as the bend of a sensor that looks like an inverter's gain."""
        before, after, best = of_rms(1.0, 2), of_rms(0.1015, 3), of_rms(0.1, 3)
        gained = gain(before, best)
        rival = replace(gained, delta_bic=gained.delta_bic - 2.0 * math.log(15.0))
        found = outcome(before, frozenset({"inverter_gain_mismatch"}), after)
        dismissed = {name: 0.0 for name in [*EFFECTS][: tried - 1] if name != "inverter_gain_mismatch"}
        law = UnnamedLaw(Element.SPEED_SENSOR, (("w |w|", 1.0),), rival, 0.1)
        judged = judge(replace(found, unnamed=law, dismissed=dismissed), 0.1)
        assert (judged.objection == "") is believed

    @pytest.mark.parametrize(
        ("mismatch", "rest", "believed"),
        [
            (Element.SHAFT, Element.SHAFT, False),
            (Element.SHAFT, Element.TORQUE_PATH, True),  # something small beside it
            (Element.TORQUE_PATH, Element.SHAFT, True),
            (Element.LOAD, Element.LOAD, True),  # it is there: a detail of how its law is written
        ],
    )
    def test_one_elsewhere_that_leaves_the_law_of_the_mismatch_where_that_was_does_not(
        self, mismatch: Element, rest: Element, believed: bool
    ) -> None:
        """A shaft that stiffens with speed, told by a tyre nearly to the noise: the shaft's law still counts."""
        before, after = of_rms(1.0, 2), of_rms(0.103, 6)
        law = UnnamedLaw(mismatch, (("twist |w_M|", 1.0),), gain(before, of_rms(0.2, 9)), 0.2)
        left = UnnamedLaw(rest, (("twist |w_M|", 1.0),), gain(after, of_rms(0.098, 9)), 0.098)
        found = outcome(before, frozenset({"tyre_slip"}), after, unnamed=law, remaining=left)
        objection = judge(found, 0.1).objection
        assert (objection == "") is believed
        assert believed or objection.endswith("twist |w_M| at the shaft, where the mismatch itself has its law")

    def test_one_whose_look_alike_is_where_the_simple_law_is_is_believed(self) -> None:
        """From torque and speed alone the two are one; the law is at the other's element."""
        found = self.nearly(selection(sensor_error(0.05), CUBIC, model(TWO_MASS, TIGHT)))
        judged = judge(replace(found, lookalikes=dict.fromkeys(found.chosen, ("resolver_error",))), SIGMA)
        assert judged.objection == ""

    @pytest.mark.parametrize(
        ("names", "believed"),
        [("speed_sign_blind", True), ("speed_sign_blind torque_saturation quadratic_friction", False)],
    )
    def test_one_law_at_one_place_speaks_against_many_names_though_one_of_them_is_there(
        self, names: str, believed: bool
    ) -> None:
        """A sensor that bends, put together from a sensor's fault, a saturation and a drag."""
        before, after, best = of_rms(1.0, 2), of_rms(0.105, 6), of_rms(0.1, 3)
        law = UnnamedLaw(Element.SPEED_SENSOR, (("w |w|", 1.0),), gain(before, best), 0.1)
        found = replace(outcome(before, frozenset(names.split()), after), unnamed=law)
        assert (judge(found, 0.1).objection == "") is believed

    def test_the_same_at_the_laws_own_element_is_believed(self) -> None:
        records = recordings(Element.SHAFT, lambda moved: moved.twist**3, 4e4)
        judged = judge(self.nearly(selection(records, CUBIC, model(TWO_MASS, TIGHT))), SIGMA)
        assert judged.unnamed is not None
        assert judged.unnamed.element is Element.SHAFT
        assert judged.verdict is Verdict.EXPLAINED

    @pytest.mark.parametrize(("law", "verdict"), [(1.25, Verdict.EXPLAINED), (1.1, Verdict.UNEXPLAINED)])
    def test_a_simple_law_at_its_own_place_that_leaves_less_than_half_is_another(
        self, law: float, verdict: Verdict
    ) -> None:
        """Of 1.4^2 - 1 = 0.96 above the noise 1.25 leaves 0.56 and 1.1 leaves 0.21."""
        records = recordings(Element.SHAFT, lambda moved: moved.twist**3, 4e4)
        found = self.nearly(selection(records, CUBIC, model(TWO_MASS, TIGHT)), 1.4)
        assert found.unnamed is not None
        level = unpredictable(residuals_by_record(found.result)) / 1.4
        rival = replace(found.unnamed, rms=law * level, gain=replace(found.unnamed.gain, delta_bic=1e9))
        judged = judge(replace(found, unnamed=rival), level)
        assert judged.verdict is verdict
        wave = replace(found, unnamed=rival, chosen=frozenset({"cardan_second_order"}))
        assert judge(wave, level).verdict is Verdict.EXPLAINED

    @pytest.mark.parametrize(
        ("term", "leaves_a_law", "believed"),
        [
            ("a relaxation of the twist in 0.04 s", True, False),
            ("a relaxation of the twist in 0.04 s", False, True),
            ("a slider that yields at 0.1 of the twist", True, True),  # hysteresis in other words
        ],
    )
    def test_hardly_seen_a_linear_law_is_another_where_the_rest_has_a_law(
        self, term: str, leaves_a_law: bool, believed: bool
    ) -> None:
        """A shaft that relaxes, told as one with hysteresis: 1.143 times the noise, and a relaxation is left."""
        before, after, best = of_rms(0.3, 2), of_rms(0.1143, 3), of_rms(0.1, 4)
        law = UnnamedLaw(Element.SHAFT, ((term, 1.0),), gain(before, best), 0.1)
        rest = UnnamedLaw(Element.SHAFT, (("a relaxation of the twist in 0.02 s", 1.0),), gain(after, best), 0.1)
        found = outcome(before, frozenset({"shaft_hysteresis"}), after, unnamed=law)
        judged = judge(replace(found, remaining=rest if leaves_a_law else None), 0.1)
        assert (judged.objection == "") is believed

    def test_what_it_leaves_is_told(self) -> None:
        """Friction of a motor that also misreads: named, and the rest is given as a law."""
        records = [replace(rec, output=rec.output + 0.013 * np.abs(rec.output)) for rec in rubbing(lambda speed: 12.0)]
        judged = judge(selection(records, COULOMB), SIGMA)
        assert judged.verdict is Verdict.EXPLAINED
        assert judged.remaining is not None
        assert judged.remaining.terms[0][0] == "|w|"
