"""What a re-tuned model lacks, from every side: laws, places and the picture of a law, on planted disturbances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import NOTHING, everything
from estimator.diagnosis.unnamed.scene import scene
from estimator.diagnosis.unnamed.search import ROUNDS, searches_at
from estimator.diagnosis.where.discrepancy import discrepancy, effects_added, without_effect
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from estimator.physics.model import Motion
from estimator.physics.problem import outputs_at
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.diagnosis.planted import SIGMA, nominal_fit, recordings, rubbing
from tests.estimator.physics.bench import ONE_MASS, model

FRICTION_NM = 6.0


@pytest.fixture(scope="module")
def rubbed() -> tuple[FitResult, FitResult]:
    """One mass with dry friction, by time stepping: re-tuned, and with the law fitted."""
    records = rubbing(lambda speed: FRICTION_NM, seeds=(1, 2, 3))
    bench = Bench(model(ONE_MASS, 0.2), records, everything(records))
    retuned = bench.fit(NOTHING)
    return retuned, bench.fit(frozenset({"coulomb_friction_motor"}), retuned)


class TestPicture:
    def test_the_data_follow_the_planted_law_and_not_only_the_fitted_one(
        self, rubbed: tuple[FitResult, FitResult]
    ) -> None:
        (picture,) = discrepancy(*rubbed, SIGMA).pictures
        assert (picture.name, picture.element, picture.signal) == (
            "coulomb_friction_motor",
            Element.MOTOR,
            "motor speed",
        )
        assert (picture.signal_unit, picture.unit) == ("rad/s", "Nm")
        away = np.abs(picture.x) > 0.3 * np.max(np.abs(picture.x))
        np.testing.assert_allclose(picture.data[away], FRICTION_NM * np.sign(picture.x[away]), rtol=0.15)
        inside = (picture.low <= picture.law) & (picture.law <= picture.high)
        assert inside.mean() > 0.6
        assert picture.explained > 0.8

    def test_a_wrong_law_does_not_lie_on_its_data(self, rubbed: tuple[FitResult, FitResult]) -> None:
        """The data come from the recordings: half the friction in the model leaves them where they were."""
        retuned, final = rubbed
        index = next(i for i, s in enumerate(final.problem.shared) if s.effect)
        x = final.x.copy()
        x[index] *= 0.5
        halved = replace(final, x=x, outputs=outputs_at(final.problem, x))
        (picture,) = discrepancy(retuned, halved, SIGMA).pictures
        away = np.abs(picture.x) > 0.3 * np.max(np.abs(picture.x))
        assert np.median(np.abs(picture.law[away])) < 0.6 * np.median(np.abs(picture.data[away]))

    def test_a_law_without_a_name_is_drawn_where_nothing_is_named(self) -> None:
        result = nominal_fit(recordings(Element.MOTOR, lambda m: m.speed * np.abs(m.speed), 0.1))
        seen = discrepancy(result, result, SIGMA, Motion.TRANSLATION)
        assert seen.element is Element.MOTOR
        (picture,) = seen.pictures
        assert (picture.signal, picture.unit) == ("motor speed", "N")
        shape = picture.x * np.abs(picture.x)
        bent = [y - np.polyval(np.polyfit(picture.x, y, 1), picture.x) for y in (picture.data, shape)]
        assert np.corrcoef(bent[0], bent[1])[0, 1] > 0.9


class TestEffects:
    def test_an_effect_is_taken_out_and_all_else_stays(self, rubbed: tuple[FitResult, FitResult]) -> None:
        retuned, final = rubbed
        assert effects_added(retuned, final) == ("coulomb_friction_motor",)
        assert effects_added(final, final) == ()
        without = without_effect(final, "coulomb_friction_motor")
        assert effects_added(retuned, without) == ()
        assert without.value("", "J_M") == final.value("", "J_M")
        its_own = sum(bool(shared.effect) for shared in final.problem.shared)
        assert its_own > 0
        assert without.jacobian.shape[1] == final.jacobian.shape[1] - its_own
        assert np.std(without.outputs[0] - final.outputs[0]) > 10 * SIGMA


class TestPlaces:
    def test_every_place_has_its_course_with_a_band(self) -> None:
        result = nominal_fit(recordings(Element.SHAFT, lambda m: np.tanh(m.twist / 1e-3), 5.0))
        seen = discrepancy(result, result, SIGMA)
        assert [e.place for e in seen.equivalents] == ["motor", "shaft", "load", "sensor"]
        assert [e.unit for e in seen.equivalents] == ["Nm", "Nm", "Nm", "rad/s"]
        for equivalent in seen.equivalents:
            for course in equivalent.courses.values():
                assert ((course.low < course.value) & (course.value < course.high)).all()
        assert any(e.plausible for e in seen.equivalents)
        assert seen.laws[0].delta_bic == max(law.delta_bic for law in seen.laws)


@pytest.mark.parametrize("rounds", [1, ROUNDS])
def test_what_a_first_look_has_found_is_not_looked_for_again(rounds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    result = nominal_fit(recordings(Element.SHAFT, lambda m: np.tanh(m.twist / 1e-3), 5.0))
    plain, begun = discrepancy(result, result, SIGMA, rounds=rounds), searches_at(scene(result, SIGMA))
    monkeypatch.setattr("estimator.diagnosis.unnamed.search.first", None)
    assert discrepancy(result, result, SIGMA, rounds=rounds, initial=begun).laws == plain.laws
