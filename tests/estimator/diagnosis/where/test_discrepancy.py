"""What a re-tuned model lacks, from every side: laws, places and the picture of a law, on planted disturbances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.hypotheses import NOTHING, all_good_samples
from estimator.diagnosis.line.line import motion_of
from estimator.diagnosis.where.discrepancy import discrepancy, effects_added, pictures_of_effects, without_effect
from estimator.diagnosis.where.locate import error_spectrum, responses
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import Motion
from estimator.physics.problem import make_problem
from estimator.physics.simulate import simulate
from estimator.physics.unknowns import effect_unknowns
from tests.estimator.diagnosis.plain import Bench
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, nominal_fit, quiet, recordings, rubbing
from tests.estimator.physics.bench import ONE_MASS, TWO_MASS, linear_record, model

FRICTION_NM = 6.0


@pytest.fixture(scope="module")
def rubbed() -> tuple[FitResult, FitResult]:
    """One mass with dry friction, by time stepping: re-tuned, and with the law fitted."""
    records = rubbing(lambda speed: FRICTION_NM, seeds=(1, 2, 3))
    bench = Bench(model(ONE_MASS, 0.2), records, all_good_samples(records))
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


def test_a_gap_is_drawn_as_the_torque_of_the_shaft_over_its_twist_with_its_dead_zone() -> None:
    gap_rad, line = 0.02, model(TWO_MASS)
    k, p = TWO_MASS["k"], flat_values(TWO_MASS, {"backlash": {"gap_rad": gap_rad}})
    drive = linear_record(TWO_MASS, drive_torque(1, 3000), START, sigma=SIGMA, seed=4)
    noise = SIGMA * np.random.default_rng(4).standard_normal(drive.output.size)
    with_gap = replace(drive, output=simulate(grid_for(line, [drive]), drive, p, START) + noise)
    final = fit(make_problem(line, [with_gap], effect_unknowns("backlash", line, [with_gap])[1].shared))
    motions = [motion_of(final, 0, is_between=True)]
    (picture,) = pictures_of_effects(("backlash",), final, motions, SIGMA, Motion.ROTATION)
    assert (picture.signal, picture.signal_unit, picture.unit) == ("twist of the shaft", "rad", "Nm")
    beyond = np.abs(picture.x) - 0.5 * gap_rad
    outside = beyond > 0.3 * gap_rad
    assert outside.sum() >= 4
    np.testing.assert_allclose(picture.law[outside], (k * beyond * np.sign(picture.x))[outside], rtol=0.3)
    assert np.abs(picture.law[np.abs(picture.x) < 0.3 * gap_rad]).max() < 0.2 * k * gap_rad


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
        assert seen.element is Element.SHAFT


START = InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0)


def test_a_softer_shaft_is_seen_in_the_response_and_the_true_one_is_not() -> None:
    rec = linear_record(TWO_MASS, drive_torque(1, 6000), START, sigma=SIGMA, seed=4)
    true = fit(make_problem(model(TWO_MASS), [rec], ()))
    soft = fit(make_problem(model({**TWO_MASS, "k": 0.8 * TWO_MASS["k"]}), [rec], ()))
    (response,) = responses(soft, true).values()
    assert response.p_before < 1e-6
    assert response.p_after > 0.01
    inside = np.abs(np.abs(response.after) - np.abs(response.measured)) <= 1.96 * response.std
    assert inside.mean() > 0.85


def test_a_recording_without_unbroken_segments_has_no_response() -> None:
    rec = linear_record(TWO_MASS, drive_torque(1), START, sigma=SIGMA, seed=4)
    okay = np.arange(rec.okay.size) % 100 >= 5  # gaps of 50 ms are too long to bridge, 0.95 s too short for a segment
    result = fit(make_problem(model(TWO_MASS), [replace(rec, okay=okay)], ()))
    assert responses(result, result) == {}


def test_a_tone_stands_in_its_band_alone() -> None:
    records = quiet((1, 2, 3))
    tone = [replace(r, output=r.output + 0.05 * np.sin(2 * np.pi * 8.0 * r.time_s)) for r in records]
    result = fit(make_problem(model(TWO_MASS), tone, ()))
    spectrum = error_spectrum(result, result, SIGMA)
    loud = [(b.low_hz, b.high_hz) for b in spectrum.bands if b.p_value < 0.01]
    assert len(loud) == 1
    assert loud[0][0] <= 8.0 < loud[0][1]
    assert spectrum.frequency_hz[np.argmax(spectrum.before)] == pytest.approx(8.0, abs=0.4)
    assert np.median(spectrum.before) == pytest.approx(spectrum.floor, rel=0.15)


def test_bands_share_the_frequencies_out() -> None:
    result = nominal_fit(quiet((1,)))
    spectrum = error_spectrum(result, result, SIGMA)
    edges = [(b.low_hz, b.high_hz) for b in spectrum.bands]
    assert [low for low, _ in edges[1:]] == [high for _, high in edges[:-1]]
    assert edges[0][0] <= spectrum.frequency_hz[0]
    assert edges[-1][1] >= spectrum.frequency_hz[-1]


@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_stands_in_no_band(seed: int) -> None:
    result = fit(make_problem(model(TWO_MASS), quiet((seed + 10, seed + 20)), ()))
    assert min(b.p_value for b in error_spectrum(result, result, SIGMA).bands) > 0.001
