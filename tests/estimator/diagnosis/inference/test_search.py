"""What is there is found among all of the catalogue, and nothing where nothing is; what a decision rests on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from estimator.diagnosis.inference.judge import Decision, decide, grounds

from estimator.diagnosis.inference.hypotheses import everything, open_hypotheses
from estimator.diagnosis.inference.search import Search
from estimator.physics.model import EffectValue
from estimator.signals.record import Record
from tests.estimator.diagnosis.one_effect import Bench, bench_with
from tests.estimator.diagnosis.planted import SIGMA

PLAIN = ("quadratic_friction", {"quadratic_nm_s2": 1e-9})
"""An effect so small that it is none."""


def searched(bench: Bench, records: list[Record] | None = None) -> Search:
    records = list(bench.records) if records is None else records
    return Search(bench.model, records, everything(records), open_hypotheses(bench.model, records)[0])


def decided(name: str, values: Mapping[str, float]) -> Decision:
    search = searched(bench_with(name, values))
    return decide(search, grounds(search))


def test_nothing_is_named_where_nothing_is_missing() -> None:
    decision = decided(*PLAIN)
    assert decision.named == decision.traces == decision.failed == ()
    assert decision.best.result.rms == pytest.approx(SIGMA, rel=0.05)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction_motor", {"friction_nm": 8.0}),
        pytest.param("actuator_lag", {"time_constant_s": 0.008}, marks=pytest.mark.campaign),
        pytest.param("backlash", {"gap_rad": 0.01}, marks=pytest.mark.campaign),
    ],
)
def test_a_planted_effect_is_named_and_explains_all(name: str, values: Mapping[str, float]) -> None:
    decision = decided(name, values)
    assert not decision.failed
    (belief,) = decision.named
    assert name in {belief.name, *belief.alike}
    assert belief.probability > 0.99
    assert 0.5 < belief.share <= 1.0
    assert belief.score > 100.0
    if belief.name == name:
        for key, value in values.items():
            assert decision.best.result.value(name, key) == pytest.approx(value, rel=0.1)


def test_every_set_is_fitted_once_and_the_best_of_them_is_taken() -> None:
    search = searched(bench_with("coulomb_friction_motor", {"friction_nm": 8.0}))
    best = search.run()
    assert search.nothing() is search.visited[frozenset()]
    assert best.score == min(each.score for each in search.visited.values())
    assert search.without(best, next(iter(best.effects))) is search.visited[frozenset()]


@pytest.mark.parametrize("wave_hz", [3.5, 11.0])
def test_a_wave_that_no_effect_makes_is_a_remainder(wave_hz: float) -> None:
    """A wave in the reading, in step with neither speed nor angle."""
    bench = bench_with(*PLAIN)
    waved = [
        replace(record, output=record.output + 2.0 * SIGMA * np.sin(2.0 * np.pi * wave_hz * record.time_s))
        for record in bench.records
    ]
    search = searched(bench, waved)
    decision = decide(search, grounds(search))
    assert "has a line in its spectrum" in {test.name for test in decision.failed}
    assert not decision.named


def knowing(bench: Bench, name: str, key: str, value: float, tolerance: float) -> Bench:
    """The same recordings with a model that knows an effect, and how far its size is trusted."""
    effects = {name: {key: EffectValue(value, None, tolerance)}}
    return replace(bench, model=replace(bench.model, effects=effects))


def test_an_effect_that_is_known_roughly_is_tuned_and_no_finding() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    roughly = knowing(bench, "coulomb_friction_motor", "friction_nm", 7.0, 0.3)
    search = searched(roughly)
    decision = decide(search, grounds(search))
    assert decision.named == decision.failed == ()
    assert decision.best.result.value("coulomb_friction_motor", "friction_nm") == pytest.approx(8.0, rel=0.02)


def test_an_effect_that_is_known_wrongly_and_held_is_a_mismatch() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    held = knowing(bench, "coulomb_friction_motor", "friction_nm", 5.0, 0.0)
    nothing = searched(held).nothing()
    assert nothing.result.rms > 1.5 * SIGMA
