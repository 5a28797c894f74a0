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


def near(text: str, value: float) -> bool:
    """Tell whether a number of a sentence is this one, to the three digits that sentences have."""
    return float(text) == pytest.approx(value, rel=5e-3)


def test_every_error_of_a_statement_is_that_of_the_decision(answered: Answered) -> None:
    said, fit = answered.diagnosis.statement, answered.decision.figures
    moves = re.findall(r"(falls|rises) from (\S+) to (\S+) rad/s", said)
    figures = [(fit.retuned, fit.augmented), (fit.holdout_retuned, fit.holdout_augmented)]
    is_named = bool(answered.decision.judged.named)
    assert len(moves) == (2 if is_named else 0)
    for (move, before, after), (was, now) in zip(moves, figures, strict=False):
        assert near(before, was)
        assert near(after, now)
        assert move == "falls"  # nothing is named else
        assert now < was
    for error, noise in re.findall(r"free-run error of (\S+) rad/s at a noise of (\S+) rad/s", said):
        assert near(error, fit.retuned)
        assert near(noise, fit.noise_floor)
    for error, noise in re.findall(r"free-run error (\S+) rad/s, noise (\S+) rad/s", said):
        assert near(error, fit.retuned)
        assert near(noise, fit.noise_floor)
    if not is_named:
        assert fit.augmented == fit.retuned
        assert fit.holdout_augmented == fit.holdout_retuned


def test_what_is_named_is_the_model_and_what_is_not_is_none_of_it(answered: Answered) -> None:
    judged, found = answered.decision.judged, answered.diagnosis
    established = {each.name for each in (*judged.named, *judged.traces)}
    tables = set() if found.table is None else {f"table_{found.table.place}"}
    assert set(found.augmented.effects) - tables == established == judged.believed.effects
    assert not established & {each.name for each in (*found.rejected, *found.refinements)}
    assert ("Not established, and not in the model: " in found.statement) is bool(found.refinements)
    for effect in found.effects:
        assert effect.statement in found.statement
        assert effect.counted is not None
        assert f"({effect.counted.right} of {effect.counted.of} such names were right)" in found.statement
        assert effect.probability <= effect.counted.right / effect.counted.of


def test_what_is_left_is_what_the_believed_set_leaves(answered: Answered) -> None:
    found, judged = answered.diagnosis, answered.decision.judged
    assert (found.remainder is None) is (not judged.failed)
    for share in re.findall(r"(\d+) % of the squared error is left", found.statement):
        assert found.remainder is not None
        assert float(share) == pytest.approx(100.0 * found.remainder.share, abs=0.5)
        assert found.verdict is Verdict.PARTLY_EXPLAINED
    for times in re.findall(r"(\S+) times the noise", found.statement):
        assert float(times) == pytest.approx(judged.believed.rms / judged.noise, rel=5e-3)


def test_no_effect_is_rejected_for_being_better(answered: Answered) -> None:
    believed = answered.decision.judged.believed
    for each in answered.diagnosis.rejected:
        assert "better by" not in each.reason
        assert each.delta_bic <= 0.0
        for left, size, believed_left, believed_size in re.findall(
            r"it leaves (\S+) on .* with (\d+) effects; what is believed leaves (\S+) with (\d+)", each.reason
        ):
            assert near(believed_left, believed.rms)
            assert int(believed_size) == believed.size
            assert float(left) >= float(believed_left) or int(size) > int(believed_size)


def test_two_inverters_are_no_cause_where_one_is_read(answered: Answered) -> None:
    records: list[Record] = list(PLAIN.records)
    assert {record.torque_nm.shape[1] for record in records} == {1}
    testable, untestable = open_hypotheses(PLAIN.model, records)
    assert "inverter_gain_mismatch" not in testable
    assert "inverter_gain_mismatch" not in untestable  # a machine with one input has no second inverter to compare
    found = answered.diagnosis
    named = {each.name for each in (*found.effects, *found.rejected, *found.refinements, *found.slight)}
    assert "inverter_gain_mismatch" not in named | {twin for each in found.effects for twin in each.alternatives}
