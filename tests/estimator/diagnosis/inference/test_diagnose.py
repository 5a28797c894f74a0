"""The whole answer: what the contract's file says of it."""

from __future__ import annotations

import pytest

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.diagnosis.result import Verdict
from estimator.physics.effect import Element
from estimator.physics.parallel import available_cores, work_on
from hil.report.diagnosis_json import diagnosis_json
from tests.estimator.diagnosis.one_effect import bench_with
from tests.estimator.diagnosis.planted import SIGMA, TIGHT, recordings
from tests.estimator.physics.bench import TWO_MASS, model as line_of


def test_a_named_effect_has_its_share_and_necessity_and_the_model_has_it() -> None:
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
    assert 0.9 < content["effects"][0]["least_necessity"] <= content["effects"][0]["necessity"] <= 1.0
    counted = content["effects"][0]["counted"]
    assert 0.5 < content["effects"][0]["probability"] <= counted["right"] / counted["of"]
    assert content["remainder"] is None
    assert content["traces"] == content["refinements"] == []
    assert content["mismatch"]["element"] == "motor"
    rejected = [rival["name"] for rival in content["rejected"]]
    left = [*(entry["name"] for entry in content["untestable"]), *content["effort"]["untried"]]
    left += content["effects"][0]["indistinguishable_from"]
    reported = ["coulomb_friction_motor", *rejected, *left]
    can_be = [name for each in open_hypotheses(bench.model, bench.records) for name in each]
    assert sorted(reported) == sorted(can_be)
    assert all(rival["delta_bic"] <= 0.0 for rival in content["rejected"])


def test_nothing_missing_is_reported_with_the_noise() -> None:
    bench = bench_with("quadratic_friction", {"quadratic_nm_s2": 1e-9})
    content = diagnosis_json(diagnose(bench.records, bench.model))
    assert content["verdict"] == "no_mismatch"
    assert content["effects"] == []
    assert content["mismatch"]["detected"] is False
    assert content["fit"]["noise_floor"] == pytest.approx(SIGMA, rel=0.05)


@pytest.mark.campaign
def test_without_recordings_kept_out_blocks_of_the_others_are() -> None:
    """A law of noise alone would leave less on fitted samples than on others."""
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    answer = diagnose(bench.records, bench.model)
    assert answer.fit.holdout_augmented != answer.fit.augmented
    assert answer.fit.holdout_augmented == pytest.approx(SIGMA, rel=0.1)


def test_a_law_of_no_entry_is_located_and_in_the_model_without_a_name() -> None:
    """A shaft that is stiffer one way than the other: no entry of the catalogue is."""
    uneven = recordings(Element.SHAFT, lambda m: m.twist**2, 1e4, seeds=(1, 2, 3))
    answer = diagnose(uneven, line_of(TWO_MASS, TIGHT))
    assert answer.verdict is Verdict.UNEXPLAINED
    assert answer.table is not None
    assert answer.table.element is answer.mismatch.element is Element.SHAFT
    assert answer.fit.holdout_augmented < 0.5 * answer.fit.holdout_retuned
    assert f"table_{answer.table.place}" in answer.augmented.effects
    assert answer.remainder is not None
    assert answer.remainder.element is Element.SHAFT
    assert answer.remainder.law.endswith(f"it follows a torque over {answer.table.over}")
    assert "Most likely it acts in the shaft" in answer.statement
    content = diagnosis_json(answer)
    assert content["unnamed"]["element"] == "shaft"
    assert content["discrepancy"]["laws"] == [content["unnamed"]]


def test_when_its_time_is_up_nothing_is_decided_and_nothing_rejected() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    answer = diagnose(bench.records, bench.model, budget_s=0.0)
    assert answer.verdict is Verdict.UNEXPLAINED
    assert (answer.effects, answer.rejected) == ((), ())
    assert answer.statement.startswith("Not decided: the search was ended after 0 s")
    effort = diagnosis_json(answer)["effort"]
    assert effort["finished"] is False
    assert "coulomb_friction_motor" in effort["untried"]


@pytest.mark.campaign
def test_the_effort_is_the_same_on_any_number_of_cores() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    contents = []
    for cores in (1, 3):
        work_on(cores)
        contents.append(diagnosis_json(diagnose(bench.records, bench.model)) | {"timing_s": None})
    work_on(available_cores())
    assert contents[0]["effort"]["simulations"] > 0
    assert contents[0] == contents[1]
