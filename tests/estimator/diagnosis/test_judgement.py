"""The verdict: floor, laws without a name, and the objections to effects that were chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.evidence import VERY_STRONG
from estimator.diagnosis.hypotheses import NOTHING, Bench, Effects, everything
from estimator.diagnosis.judgement import ABOVE_FLOOR, judge
from estimator.diagnosis.result import Verdict
from estimator.diagnosis.selection import VISIBLE, Selection
from estimator.diagnosis.unnamed import best_unnamed
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel
from estimator.physics.simulate import Start
from estimator.signals.record import OutputKind, Record
from tests.estimator.diagnosis.planted import SIGMA, TIGHT, drive_torque, quiet, recordings, rubbing
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model

COULOMB: Effects = frozenset({"coulomb_friction_motor"})


def selection(records: Sequence[Record], chosen: Effects = NOTHING, line: DrivelineModel | None = None) -> Selection:
    """What a selection that chose these effects hands over."""
    bench = Bench(line or model(ONE_MASS), records, everything(records))
    retuned = bench.fit(NOTHING)
    return Selection(retuned, chosen, bench.fit(chosen, retuned), {}, {})


def sensor_error(coefficient: float) -> list[Record]:
    return recordings(Element.SPEED_SENSOR, lambda moved: np.abs(moved.speed), coefficient)


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


class TestChosen:
    def test_an_effect_that_reaches_the_floor_explains(self) -> None:
        judged = judge(selection(rubbing(lambda speed: 12.0), COULOMB), SIGMA)
        assert (judged.verdict, judged.objection) == (Verdict.EXPLAINED, "")
        assert judged.remaining is None

    def test_one_that_leaves_most_standing_does_not(self) -> None:
        judged = judge(selection(rubbing(lambda speed: 12.0), frozenset({"actuator_lag"})), SIGMA)
        assert judged.verdict is Verdict.UNEXPLAINED
        assert judged.objection == "lag of the torque would leave most of the mismatch standing"

    def test_a_profile_that_leaves_a_law_does_not(self) -> None:
        """A road may follow anything slow; what it leaves of dry friction, it does not explain."""
        judged = judge(selection(rubbing(lambda speed: 12.0), frozenset({"road_grade"})), SIGMA)
        assert judged.verdict is Verdict.UNEXPLAINED
        assert judged.remaining is not None
        assert judged.remaining.element is Element.MOTOR
        law = judged.remaining.terms[0][0]
        assert judged.objection == f"road grade would leave {law} at the motor unexplained"

    def test_one_elsewhere_that_a_simple_law_beats_does_not(self) -> None:
        """Two thirds of a sensor's error removed by a shaft effect, all of it by |w| at the sensor."""
        chosen = selection(sensor_error(0.05), frozenset({"stiffness_nonlinearity"}), model(TWO_MASS, TIGHT))
        partly = replace(chosen, result=replace(chosen.result, residual=0.6 * chosen.retuned.residual))
        judged = judge(partly, SIGMA)
        assert judged.verdict is Verdict.UNEXPLAINED
        assert judged.objection == (
            "a law of |w| at the speed_sensor explains it with less than hardening or softening shaft"
        )

    def test_the_same_at_the_laws_own_element_is_believed(self) -> None:
        records = recordings(Element.SHAFT, lambda moved: moved.twist**3, 4e4)
        chosen = selection(records, frozenset({"stiffness_nonlinearity"}), model(TWO_MASS, TIGHT))
        partly = replace(chosen, result=replace(chosen.result, residual=0.6 * chosen.retuned.residual))
        judged = judge(partly, SIGMA)
        assert judged.unnamed is not None
        assert judged.unnamed.element is Element.SHAFT
        assert judged.verdict is Verdict.EXPLAINED

    def test_what_it_leaves_is_told(self) -> None:
        """Friction of a motor that also misreads: named, and the rest is given as a law."""
        records = [replace(rec, output=rec.output + 0.02 * np.abs(rec.output)) for rec in rubbing(lambda speed: 12.0)]
        judged = judge(selection(records, COULOMB), SIGMA)
        assert judged.verdict is Verdict.EXPLAINED
        assert judged.remaining is not None
        assert judged.remaining.terms[0][0] == "|w|"
