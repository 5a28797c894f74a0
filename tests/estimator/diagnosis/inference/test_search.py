"""What is there is found among all of the catalogue, and nothing where nothing is; what a decision rests on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.inference.decide import Decision
from estimator.diagnosis.inference.hypotheses import GRADE
from estimator.physics.driveline import InitialCondition
from estimator.physics.layout import flat_values, grid_for
from estimator.physics.model import EffectValue
from estimator.physics.simulate import simulate
from tests.estimator.diagnosis.one_effect import Bench, bench_with, decided, searched
from tests.estimator.diagnosis.planted import SAMPLES, SIGMA, drive_torque
from tests.estimator.physics.bench import TWO_MASS, model, record

PLAIN = ("quadratic_friction", {"quadratic_nm_s2": 1e-9})
"""An effect so small that it is none."""


def decided_with(name: str, values: Mapping[str, float]) -> Decision:
    return decided(searched(bench_with(name, values)))


def test_nothing_is_named_where_nothing_is_missing() -> None:
    judged = decided_with(*PLAIN).judged
    assert judged.named == judged.traces == judged.failed == judged.refinements == ()
    assert judged.believed.hypothesis.result.rms == pytest.approx(SIGMA, rel=0.05)


def test_where_noise_is_left_only_what_promises_more_than_it_costs_is_fitted() -> None:
    fits = searched(bench_with(*PLAIN)).fits
    fitted = {name for effects in (*fits.rough, *fits.ended) for name in effects - {GRADE}} | {*fits.implausible}
    assert fitted <= {name for name, score in fits.foreseen.items() if score < fits.nothing().score}
    assert 0 < len(fitted) < len(fits.foreseen)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction_motor", {"friction_nm": 8.0}),
        pytest.param("actuator_lag", {"time_constant_s": 0.008}, marks=pytest.mark.campaign),
        pytest.param("backlash", {"gap_rad": 0.01}, marks=pytest.mark.campaign),
    ],
)
def test_a_planted_effect_is_named_and_explains_all(name: str, values: Mapping[str, float]) -> None:
    judged = decided_with(name, values).judged
    assert not judged.failed
    (standing,) = judged.named
    assert name in {standing.name, *standing.alike}
    assert standing.necessity.least > 0.9
    assert 0.5 < standing.share <= 1.0
    assert standing.evidence > 100.0
    if standing.name == name:
        for key, value in values.items():
            assert judged.believed.hypothesis.result.value(name, key) == pytest.approx(value, rel=0.1)


def test_a_shaft_that_is_softer_for_a_while_is_no_generator_that_is_coupled() -> None:
    """Either is first seen where the other one is: the moments of the one are handed over to the other."""
    softer = {"change": -0.27, "from_s": 4.0, "to_s": 9.5}
    search = searched(bench_with("stiffness_change", softer), ["generator_coupled", "stiffness_change", "brake_drag"])
    judged = decided(search).judged
    assert [each.name for each in judged.named] == ["stiffness_change"]
    assert "generator_coupled" not in judged.named[0].alike
    result = judged.believed.hypothesis.result
    assert result.value("stiffness_change", "change") == pytest.approx(-0.27, abs=0.02)


def test_a_torque_that_fades_from_one_recording_to_the_next_is_one_effect() -> None:
    """It is lost as time passes, in and between recordings of which the first began cold; the line gets the rest."""
    depth, tau_s, began_s = 0.12, 8.0, (0.0, 15.0, 60.0)
    line, recordings = model(TWO_MASS, 0.2), []
    for seed, since_s in enumerate(began_s):
        read = record(drive_torque(seed), np.zeros(SAMPLES), name=f"run_{seed}")
        left = 1.0 - depth * (1.0 - np.exp(-(since_s + read.time_s - read.time_s[0]) / tau_s))
        real = replace(read, torque_nm=read.torque_nm * left[:, np.newaxis])
        output = simulate(grid_for(line, [real]), real, flat_values(TWO_MASS, {}), InitialCondition(5.0, 0.0, 2.0))
        noise = SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
        recordings.append(replace(read, output=output + noise))
    names = ["torque_derating", "torque_nonlinearity", "inertia_change", "warming_friction"]
    judged = decided(searched(Bench(line, recordings), names)).judged
    assert [each.name for each in judged.named] == ["torque_derating"]
    assert not judged.failed
    result = judged.believed.hypothesis.result
    assert result.value("torque_derating", "depth") == pytest.approx(depth, rel=0.05)
    assert result.value("torque_derating", "time_constant_s") == pytest.approx(tau_s, rel=0.1)
    warm = [result.local_of(i)[result.problem.local[i].own_rows][0] for i in range(3)]
    np.testing.assert_allclose(warm, 1.0 - np.exp(-np.array(began_s) / tau_s), atol=0.03)


def test_every_set_is_fitted_once() -> None:
    search = searched(bench_with("coulomb_friction_motor", {"friction_nm": 8.0}))
    best, fits = search.best, search.fits
    assert fits.nothing() is fits.ended[frozenset()]
    assert best is fits.ended[best.effects]
    assert best.score == min(each.score for each in fits.ended.values() if len(each.effects) <= len(best.effects))
    assert fits.without(best, next(iter(best.effects))) is fits.ended[frozenset()]


@pytest.mark.parametrize("wave_hz", [3.5, 11.0])
def test_a_wave_that_no_effect_makes_is_a_remainder(wave_hz: float) -> None:
    """A wave in the reading, in step with neither speed nor angle."""
    bench = bench_with(*PLAIN)
    waved = [
        replace(record, output=record.output + 2.0 * SIGMA * np.sin(2.0 * np.pi * wave_hz * record.time_s))
        for record in bench.records
    ]
    judged = decided(searched(replace(bench, records=waved))).judged
    assert "has a line in its spectrum" in {test.name for test in judged.failed}
    assert not judged.named


def knowing(bench: Bench, name: str, key: str, value: float, tolerance: float) -> Bench:
    """The same recordings with a model that knows an effect, and how far its size is trusted."""
    effects = {name: {key: EffectValue(value, None, tolerance)}}
    return replace(bench, model=replace(bench.model, effects=effects))


def test_an_effect_that_is_known_roughly_is_tuned_and_no_finding() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    judged = decided(searched(knowing(bench, "coulomb_friction_motor", "friction_nm", 7.0, 0.3))).judged
    assert judged.named == judged.failed == ()
    assert judged.believed.hypothesis.result.value("coulomb_friction_motor", "friction_nm") == pytest.approx(
        8.0, rel=0.02
    )


def test_an_effect_that_is_known_wrongly_and_held_is_a_mismatch() -> None:
    bench = bench_with("coulomb_friction_motor", {"friction_nm": 8.0})
    held = knowing(bench, "coulomb_friction_motor", "friction_nm", 5.0, 0.0)
    assert searched(held, ["quadratic_friction"]).fits.nothing().result.rms > 1.5 * SIGMA
