"""Sentences are read back: every number of a statement is the decision's, and no reason contradicts them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from estimator.diagnosis.inference.decide import Decision
from estimator.diagnosis.inference.hypotheses import open_hypotheses
from estimator.diagnosis.inference.search import Search
from estimator.diagnosis.result import Diagnosis, Verdict
from estimator.signals.record import Record
from tests.estimator.diagnosis.one_effect import Bench, bench_with, decided, diagnosed, searched
from tests.estimator.diagnosis.planted import SIGMA, quiet
from tests.estimator.diagnosis.sentences import contradictions
from tests.estimator.physics.bench import TWO_MASS, model

PLAIN = bench_with("quadratic_friction", {"quadratic_nm_s2": 1e-9})
FRICTION = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})


def waved(bench: Bench, times_noise: float) -> Bench:
    """The same recordings with a wave in the reading that no effect makes."""
    waves = [times_noise * SIGMA * np.sin(2.0 * np.pi * 11.0 * record.time_s) for record in bench.records]
    records = [replace(each, output=each.output + wave) for each, wave in zip(bench.records, waves, strict=True)]
    return replace(bench, records=records)


def with_a_stiff_sheet() -> Bench:
    return Bench(model(TWO_MASS | {"k": TWO_MASS["k"] / 1.3}, 0.1), quiet())


RUBS = ("coulomb_friction_motor", "coulomb_friction_load", "quadratic_friction")
CASES: dict[str, tuple[Callable[[], Bench], tuple[str, ...], Verdict]] = {
    "nothing": (lambda: PLAIN, RUBS, Verdict.NO_MISMATCH),
    "friction": (lambda: FRICTION, RUBS, Verdict.EXPLAINED),
    "friction and a wave": (lambda: waved(FRICTION, 2.0), RUBS, Verdict.PARTLY_EXPLAINED),
    "a wave alone": (lambda: waved(PLAIN, 2.0), RUBS, Verdict.UNEXPLAINED),
    "friction without its law": (lambda: FRICTION, ("torque_bias", "actuator_lag"), Verdict.UNEXPLAINED),
    "lag": (
        lambda: bench_with("actuator_lag", {"time_constant_s": 0.02}),
        ("actuator_lag", "transport_delay", "speed_filter"),
        Verdict.EXPLAINED,
    ),
    "backlash": (
        lambda: bench_with("backlash", {"gap_rad": 0.02}),
        ("backlash", "stiffness_nonlinearity"),
        Verdict.EXPLAINED,
    ),
    "drag": (
        lambda: bench_with("quadratic_friction", {"quadratic_nm_s2": 0.2}),
        ("quadratic_friction", "coulomb_friction_motor"),
        Verdict.EXPLAINED,
    ),
    "a data sheet that is off": (with_a_stiff_sheet, RUBS, Verdict.UNEXPLAINED),
}


@dataclass(frozen=True)
class Answered:
    search: Search
    decision: Decision
    diagnosis: Diagnosis


@pytest.fixture(scope="module", params=CASES)
def answered(request: pytest.FixtureRequest) -> Answered:
    make, names, expected = CASES[request.param]
    search = searched(make(), names)
    decision = decided(search)
    diagnosis = diagnosed(search, decision)
    assert diagnosis.verdict is expected, diagnosis.statement
    return Answered(search, decision, diagnosis)


def test_no_sentence_contradicts_the_numbers(answered: Answered) -> None:
    assert contradictions(answered.diagnosis) == []


def test_the_figures_that_are_shown_are_those_of_the_decision(answered: Answered) -> None:
    fit, judged = answered.decision.figures, answered.decision.judged
    shown = answered.diagnosis.fit
    if answered.diagnosis.table is not None:  # the augmented model has the law without a name, too
        shown = replace(shown, augmented=fit.augmented, holdout_augmented=fit.holdout_augmented)
    assert shown == fit
    assert len(re.findall(r"(?:falls|rises) from", answered.diagnosis.statement)) == (2 if judged.named else 0)
    if not judged.named:
        assert fit.augmented == fit.retuned
        assert fit.holdout_augmented == fit.holdout_retuned


def test_what_is_named_is_the_model_and_what_is_not_is_none_of_it(answered: Answered) -> None:
    judged, found = answered.decision.judged, answered.diagnosis
    established = {each.name for each in (*judged.named, *judged.traces)}
    tables = set() if found.table is None else {f"table_{found.table.place}"}
    assert set(found.augmented.effects) - tables == established == judged.believed.effects
    for effect in found.effects:
        assert effect.counted is not None
        assert f"({effect.counted.words}" in found.statement


def test_what_is_left_is_what_the_believed_set_leaves(answered: Answered) -> None:
    found, judged, figures = answered.diagnosis, answered.decision.judged, answered.decision.figures
    assert (found.remainder is None) is (not judged.failed)
    for times in re.findall(r"(\S+) times the noise", found.statement):
        assert float(times) == pytest.approx(figures.augmented / judged.noise, rel=5e-3)


def test_two_inverters_are_no_cause_where_one_is_read(answered: Answered) -> None:
    records: list[Record] = list(PLAIN.records)
    assert {record.torque_nm.shape[1] for record in records} == {1}
    testable, untestable = open_hypotheses(PLAIN.model, records)
    assert "inverter_gain_mismatch" not in testable
    assert "inverter_gain_mismatch" not in untestable  # a machine with one input has no second inverter to compare


def reworded(found: Diagnosis, pattern: str, by: str) -> Diagnosis:
    statement, count = re.subn(pattern, by, found.statement, count=1)
    assert count
    return replace(found, statement=statement)


def test_a_sentence_that_says_another_thing_is_seen(answered: Answered) -> None:
    """So that an empty list of contradictions means something."""
    found = answered.diagnosis
    if found.effects:
        assert contradictions(reworded(found, r"falls from \S+", "falls from 99.9"))
        assert contradictions(reworded(found, "falls from", "rises from"))
        assert contradictions(replace(found, effects=(*found.effects, replace(found.effects[0], statement="more"))))
        assert contradictions(replace(found, effects=(replace(found.effects[0], probability=1.0),)))
    else:
        assert contradictions(reworded(found, r"free-run error( of)? \S+", r"free-run error\1 99.9"))
    if found.remainder is not None and not found.off_nominal:
        assert contradictions(reworded(found, r"\S+ times the noise", "99 times the noise"))
    for each in found.rejected[:1]:
        assert contradictions(replace(found, rejected=(replace(each, delta_bic=1.0),)))
    assert contradictions(reworded(found, "$", " It is inverter m2."))
