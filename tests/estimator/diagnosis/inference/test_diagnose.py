"""The whole answer by likelihood: what the contract's file says of it."""

from __future__ import annotations

import pytest

from estimator.diagnosis.inference.diagnose import diagnose
from estimator.diagnosis.result import Verdict
from hil.report.diagnosis_json import diagnosis_json
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA


def test_a_named_effect_has_its_share_and_probability_and_the_model_has_it() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    answer = diagnose(bench.records, bench.model)
    assert answer.verdict is Verdict.EXPLAINED
    (effect,) = answer.effects
    low, high = effect.parameters["friction_nm"].ci95
    assert low < effect.parameters["friction_nm"].value < high < 1.1 * low
    assert answer.augmented.effects["coulomb_friction_motor"]["friction_nm"].value == pytest.approx(8.0, rel=0.02)
    assert answer.fit.augmented == pytest.approx(SIGMA, rel=0.1)
    assert answer.fit.retuned > 2.0 * answer.fit.augmented
    content = diagnosis_json(answer)
    assert content["effects"][0]["share"] == pytest.approx(1.0, abs=0.1)
    assert content["effects"][0]["probability"] > 0.99
    assert content["remainder"] is None
    assert content["traces"] == []
    assert content["mismatch"]["element"] == "motor"


def test_nothing_missing_is_told_with_the_noise() -> None:
    bench = bench_with("quadratic_friction", {"quadratic_nm_s2": 1e-9})
    content = diagnosis_json(diagnose(bench.records, bench.model))
    assert content["verdict"] == "no_mismatch"
    assert content["effects"] == []
    assert content["mismatch"]["detected"] is False
    assert content["fit"]["noise_floor"] == pytest.approx(SIGMA, rel=0.05)
