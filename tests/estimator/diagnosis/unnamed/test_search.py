"""Every kind of law without a name, planted as a small disturbance, is found at its element and in its size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.noise import noise_floor
from estimator.diagnosis.result import RankedLaw
from estimator.diagnosis.unnamed.forms import peaks
from estimator.diagnosis.unnamed.scene import scene
from estimator.diagnosis.unnamed.search import (
    LEAST_ROUNDS,
    ROUNDS,
    ElementSearch,
    judged,
    outliers,
    searches_at,
)
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult
from tests.estimator.diagnosis.planted import SIGMA, Law, nominal_fit, quiet, recordings
from tests.estimator.physics.bench import TWO_MASS, linear_record

# Element, name of the law, the law, coefficient: 5 to 10 % of the torque or 1 % of the speed in use.
PLANTED: list[tuple[Element, str, Law, float]] = [
    (Element.TORQUE_PATH, "a torque one period late", lambda m: -np.diff(m.torque, prepend=m.torque[0]), 0.05),
    (Element.TORQUE_PATH, "T |T|", lambda m: m.torque * np.abs(m.torque), 3e-4),
    (Element.TORQUE_PATH, "T t", lambda m: m.torque * m.time_s, -4e-3),
    (Element.MOTOR, "sign(w_M)", lambda m: np.tanh(m.speed / 0.1), 3.0),
    (Element.MOTOR, "w_M |w_M|", lambda m: m.speed * np.abs(m.speed), 0.1),
    (Element.MOTOR, "w_M exp(-t / 10 s)", lambda m: m.speed * np.exp(-m.time_s / 10.0), 1.0),
    (Element.SHAFT, "twist |twist|", lambda m: m.twist * np.abs(m.twist), 1200.0),
    (Element.SHAFT, "twist^3", lambda m: m.twist**3, 2e4),
    (Element.SHAFT, "sign(twist)", lambda m: np.tanh(m.twist / 1e-3), 5.0),
    (Element.SHAFT, "sign(d twist/dt)", lambda m: np.tanh((m.speed - m.load_speed) / 0.05), 3.0),
    (Element.LOAD, "sign(w_L)", lambda m: np.tanh(m.load_speed / 0.1), 5.0),
    (Element.LOAD, "w_L |w_L|", lambda m: m.load_speed * np.abs(m.load_speed), 0.2),
    (Element.SPEED_SENSOR, "dw/dt", lambda m: np.gradient(m.speed, m.time_s), -1.5e-3),
    (Element.SPEED_SENSOR, "|w|", lambda m: np.abs(m.speed), 0.03),
]


def unnamed_laws(result: FitResult, rounds: int = 1) -> list[RankedLaw]:
    view = scene(result, noise_floor(result.problem.records))
    return judged(view, searches_at(view, rounds))


def best_unnamed(result: FitResult) -> RankedLaw | None:
    """Return the law without a name that gains most over a fit; None where no candidate gains anything."""
    found = [law for law in unnamed_laws(result) if law.delta_bic > 0]
    return max(found, key=lambda law: law.delta_bic, default=None)


@pytest.mark.parametrize(
    ("element", "name", "law", "coefficient"), PLANTED, ids=[f"{e.value}-{n}" for e, n, *_ in PLANTED]
)
def test_a_planted_law_is_found_where_it_acts_and_in_its_size(
    element: Element, name: str, law: Law, coefficient: float
) -> None:
    result = nominal_fit(recordings(element, law, coefficient))
    assert result.rms > 1.1 * SIGMA
    found = best_unnamed(result)
    assert found is not None
    assert found.element is element
    assert found.rms < 0.9 * result.rms
    assert found.p_value < 1e-6
    alone = dict(found.terms).get(name)
    if alone is not None and len(found.terms) == 1:
        assert alone == pytest.approx(coefficient, rel=0.35)  # what re-tuning took of it is missing


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_a_wave_over_the_angle_is_found_in_the_reading(order: float) -> None:
    """About two waves per turn with the speed's own sign: an angle error of the resolver."""
    planted = recordings(Element.SPEED_SENSOR, lambda m: m.speed * np.sin(order * m.angle + 0.7), 0.03)
    found = best_unnamed(nominal_fit(planted))
    assert found is not None
    assert found.element is Element.SPEED_SENSOR
    assert found.terms[0][0] == f"a wave of w {order:.3g} times per motor turn"


def test_a_step_of_the_load_is_found_in_its_recording_at_its_moment() -> None:
    records = quiet()
    load = np.where(records[1].time_s >= 6.0, 8.0, 0.0)
    start = InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0)
    records[1] = linear_record(
        TWO_MASS, records[1].total_torque_nm, start, sigma=SIGMA, seed=2, name="run_2", extra_load_nm=load
    )
    found = best_unnamed(nominal_fit(records))
    assert found is not None
    assert found.element is Element.LOAD
    assert found.terms[0][0] == "a load step at 6.0 s in run_2"
    assert found.terms[0][1] == pytest.approx(8.0, rel=0.1)


@pytest.mark.parametrize("seed", range(3, 7))
def test_where_nothing_is_missing_no_law_is_beyond_chance(seed: int) -> None:
    found = best_unnamed(nominal_fit(quiet((seed, seed + 100))))
    assert found is None or found.delta_bic < 10.0


def test_a_large_mismatch_is_located_by_simulating_with_the_law_found() -> None:
    """A slack shaft under full reversals moves the parameters to their bounds; the first look promises too much."""
    loose = recordings(Element.SHAFT, lambda m: np.tanh(m.twist / 4e-3), 12.0, seeds=(1, 2))
    result = nominal_fit(loose, tolerance=0.2)
    laws = unnamed_laws(result, ROUNDS)
    best = max(laws, key=lambda law: law.delta_bic)
    assert best.element is Element.SHAFT
    others = [law.rms for law in laws if law.element is not Element.SHAFT]
    assert best.rms < 0.5 * result.rms
    assert best.rms < 0.7 * min(others)


@pytest.mark.parametrize(
    ("falls", "rounds"),
    [
        ((0.0,) * ROUNDS, LEAST_ROUNDS),
        ((0.0, 0.0, 0.1, 0.1, 0.1, 0.001, 0.1), 8),
        ((0.01,) * ROUNDS, ROUNDS),
    ],
    ids=["a few in any case", "while one helps", "not for ever"],
)
def test_a_law_is_looked_for_again_for_as_long_as_that_helps(
    monkeypatch: pytest.MonkeyPatch, falls: tuple[float, ...], rounds: int
) -> None:
    """At any element in reach, be it the best or not, and at that alone; the first two looks are from the fit alone."""
    view = scene(nominal_fit(quiet((1,))), SIGMA)
    first = [
        replace(state, rounds=2, mean_square=SIGMA**2 * (1 + i), stuck=i > 1)
        for i, state in enumerate(searches_at(view))
    ]
    looks: list[Element] = []

    def again(state: ElementSearch) -> ElementSearch:
        looks.append(state.element)
        fall = falls[looks.count(state.element) - 1] if state.element is first[1].element else 0.0
        return replace(state, mean_square=(1.0 - fall) * state.mean_square)

    monkeypatch.setattr("estimator.diagnosis.unnamed.search.again", again)
    found = searches_at(view, ROUNDS, first)
    assert looks.count(first[1].element) == rounds - 2
    assert looks.count(first[0].element) == LEAST_ROUNDS - 2
    assert set(looks) == {state.element for state in first[:2]}
    assert {state.rounds for state in found} == {ROUNDS}


def test_single_readings_that_are_off_are_the_acquisitions() -> None:
    rng = np.random.default_rng(8)
    spoilt = []
    for rec in quiet():
        output = rec.output.copy()
        output[rng.choice(output.size, 15, replace=False)] += rng.choice([-1.0, 1.0], 15)
        spoilt.append(replace(rec, output=output))
    found = best_unnamed(nominal_fit(spoilt))
    assert found is not None
    assert found.element is Element.ACQUISITION
    assert found.terms[0] == ("the single readings that are off", pytest.approx(1.0, rel=0.05))
    assert found.rms == pytest.approx(SIGMA, rel=0.1)


def test_orders_of_waves_are_found_strongest_first() -> None:
    time_s = np.arange(0.0, 30.0, 0.01)
    angle = 20.0 * time_s + 0.6 * time_s**2
    wave = 3.0 * np.cos(3.0 * angle + 1.0) + 0.5 * np.sin(0.4 * angle)
    found = peaks([wave, wave[::-1]], [angle, angle[::-1]])
    assert found[0] == pytest.approx(3.0, abs=0.01)
    assert np.min(np.abs(found - 0.4)) < 0.01


def test_what_does_not_turn_has_no_orders() -> None:
    assert peaks([np.ones(100)], [np.zeros(100)]).size == 0


def test_strays_are_distinguished_from_a_swing_and_from_noise() -> None:
    rng = np.random.default_rng(3)
    time_s = np.arange(0.0, 30.0, 0.01)
    error = 0.2 * np.sin(2 * np.pi * 1.0 * time_s) + 0.02 * rng.standard_normal(time_s.size)
    assert not outliers([error])[0].any()
    for seed in range(10):
        assert not outliers([np.random.default_rng(seed).standard_normal(9000)])[0].any()
    error[[100, 2000]] += [0.6, -0.6]
    assert np.flatnonzero(outliers([error])[0]).tolist() == [100, 2000]
