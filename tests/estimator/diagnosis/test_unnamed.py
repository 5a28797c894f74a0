"""Every kind of law without a name, planted as a small disturbance, is found at its element and in its size."""

from __future__ import annotations

import math

import numpy as np
import pytest

from estimator.diagnosis.disturbances import candidates
from estimator.diagnosis.evidence import gain_from_squares
from estimator.diagnosis.unnamed import _Projector, best_unnamed, unnamed_laws
from estimator.physics.effect import Element
from estimator.physics.simulate import Start
from tests.estimator.diagnosis.planted import SIGMA, Law, nominal_fit, quiet, recordings
from tests.estimator.physics.bench import TWO_MASS, linear_record

# Element, name of the law, the law, coefficient: 5 to 10 % of the torque or 1 % of the speed in use.
PLANTED: list[tuple[Element, str, Law, float]] = [
    (Element.TORQUE_PATH, "dT/dt", lambda m: np.diff(m.torque, prepend=m.torque[0]), -0.05),
    (Element.TORQUE_PATH, "T |T|", lambda m: m.torque * np.abs(m.torque), 3e-4),
    (Element.TORQUE_PATH, "T t", lambda m: m.torque * m.time_s, -4e-3),
    (Element.MOTOR, "sign(w_M)", lambda m: np.tanh(m.speed / 0.1), 3.0),
    (Element.MOTOR, "w_M |w_M|", lambda m: m.speed * np.abs(m.speed), 0.1),
    (Element.MOTOR, "w_M exp(-t/T)", lambda m: m.speed * np.exp(-m.time_s / 10.0), 1.0),
    (Element.SHAFT, "twist |twist|", lambda m: m.twist * np.abs(m.twist), 1200.0),
    (Element.SHAFT, "twist^3", lambda m: m.twist**3, 2e4),
    (Element.SHAFT, "sign(twist)", lambda m: np.tanh(m.twist / 1e-3), 5.0),
    (Element.SHAFT, "sign(d twist/dt)", lambda m: np.tanh((m.speed - m.load_speed) / 0.05), 3.0),
    (Element.LOAD, "sign(w_L)", lambda m: np.tanh(m.load_speed / 0.1), 5.0),
    (Element.LOAD, "w_L |w_L|", lambda m: m.load_speed * np.abs(m.load_speed), 0.2),
    (Element.SPEED_SENSOR, "dw/dt", lambda m: np.gradient(m.speed, m.time_s), -1.5e-3),
    (Element.SPEED_SENSOR, "|w|", lambda m: np.abs(m.speed), 0.03),
    (Element.SPEED_SENSOR, "sin(angle)", lambda m: m.speed * np.sin(m.angle), 0.03),
    (Element.SPEED_SENSOR, "cos(angle)", lambda m: m.speed * np.cos(m.angle), 0.03),
    (Element.SPEED_SENSOR, "sin(2 angle)", lambda m: m.speed * np.sin(2 * m.angle), 0.03),
    (Element.SPEED_SENSOR, "cos(2 angle)", lambda m: m.speed * np.cos(2 * m.angle), 0.03),
]


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
    assert found.terms[0][0] == name
    assert found.terms[0][1] == pytest.approx(coefficient, rel=0.35)  # what re-tuning took of it is missing
    assert found.rms < 0.9 * result.rms
    assert found.gain.p_value < 1e-6


def test_a_step_of_the_load_is_found_in_its_recording_at_its_moment() -> None:
    records = quiet()
    load = np.where(records[1].time_s >= 6.0, 8.0, 0.0)
    start = Start(5.0, 0.0, 2.0, 0.0, 2.0)
    records[1] = linear_record(
        TWO_MASS, records[1].total_torque_nm, start, sigma=SIGMA, seed=2, name="run_2", extra_load_nm=load
    )
    found = best_unnamed(nominal_fit(records))
    assert found is not None
    assert found.element is Element.LOAD
    assert found.terms[0][0] == "load step at 6.0 s in run_2"
    assert found.terms[0][1] == pytest.approx(8.0, rel=0.1)


def test_steps_in_both_recordings_take_several_terms_and_leave_the_noise() -> None:
    """The larger step is found as it is; the smaller one as a sum of neighbours: the pursuit is greedy."""
    start, steps = Start(5.0, 0.0, 2.0, 0.0, 2.0), {"run_1": (4.0, 8.0), "run_2": (9.0, -12.0)}
    records = [
        linear_record(
            TWO_MASS,
            rec.total_torque_nm,
            start,
            sigma=SIGMA,
            seed=seed,
            name=rec.name,
            extra_load_nm=np.where(rec.time_s >= steps[rec.name][0], steps[rec.name][1], 0.0),
        )
        for seed, rec in enumerate(quiet())
    ]
    found = best_unnamed(nominal_fit(records))
    assert found is not None
    assert found.element is Element.LOAD
    assert dict(found.terms)["load step at 9.0 s in run_2"] == pytest.approx(-12.0, rel=0.1)
    assert found.rms == pytest.approx(SIGMA, rel=0.1)


@pytest.mark.parametrize("seed", range(3, 7))
def test_where_nothing_is_missing_no_law_is_beyond_chance(seed: int) -> None:
    found = best_unnamed(nominal_fit(quiet((seed, seed + 100))))
    assert found is None or found.gain.delta_bic < 10.0


def test_each_element_that_has_candidates_has_a_law() -> None:
    result = nominal_fit(quiet((1,)))
    laws = unnamed_laws(result)
    assert [law.element for law in laws] == [
        Element.TORQUE_PATH,
        Element.MOTOR,
        Element.SHAFT,
        Element.LOAD,
        Element.SPEED_SENSOR,
    ]


def test_what_re_tuning_explains_is_not_a_law() -> None:
    """A load inertia within its tolerance is d w_L/dt at the load: projected out, nothing is left of it."""
    result = nominal_fit(quiet((1,)))
    projector = _Projector(result)
    pool = {(c.element, c.law): c for c in candidates(result)}
    inertia, drag = pool[Element.LOAD, "dw_L/dt"], pool[Element.LOAD, "w_L |w_L|"]
    stacked = np.concatenate(inertia.answers)
    assert projector.answer(inertia)[1] < 0.05 * np.linalg.norm(stacked)
    answer, norm = projector.answer(drag)
    assert norm > 0.05 * np.linalg.norm(np.concatenate(drag.answers))
    assert np.linalg.norm(answer) == pytest.approx(1.0)
    free = result.jacobian[:, ~result.pinned]
    assert np.max(np.abs(free.T @ answer)) < 1e-8 * np.max(np.abs(result.jacobian))


def test_a_column_of_the_jacobian_is_nothing_at_all() -> None:
    result = nominal_fit(quiet((1,)))
    (candidate, *_) = candidates(result)
    copy = type(candidate)(Element.MOTOR, "a parameter", (result.jacobian[:, 2].copy(),))
    answer, norm = _Projector(result).answer(copy)
    assert (norm, answer.any()) == (0.0, False)


def test_a_law_pays_for_its_terms_and_for_having_been_chosen() -> None:
    element, _, law, coefficient = PLANTED[4]
    result = nominal_fit(recordings(element, law, coefficient, seeds=(1,)))
    found = best_unnamed(result)
    assert found is not None
    terms = len(found.terms)
    pool = [c for c in candidates(result) if c.element is found.element]
    projector = _Projector(result)
    names = [c.law for c in pool]
    columns = np.array([projector.answer(pool[names.index(name)])[0] for name, _ in found.terms]).T
    error = projector.rest(result.residual)
    left = error - columns @ np.linalg.lstsq(columns, error, rcond=None)[0]
    plain = gain_from_squares(float(error @ error), float(left @ left), terms, result.x.size + terms, [left])
    assert found.rms == pytest.approx(np.sqrt(np.mean(left**2)))
    assert found.gain.delta_bic == pytest.approx(plain.delta_bic - 2.0 * terms * math.log(len(pool)), rel=1e-6)
    assert found.gain.p_value == pytest.approx(min(1.0, plain.p_value * math.comb(len(pool), terms)), rel=1e-3)
