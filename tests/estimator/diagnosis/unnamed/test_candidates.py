"""The output's answer to a law, against the exact response of a linear driveline."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from estimator.diagnosis.line.blocks import motion_of
from estimator.diagnosis.unnamed.forms import STEP_EVERY_S, candidates
from estimator.diagnosis.unnamed.scene import Scene, elements, scene
from estimator.physics.driveline import Start
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray, OutputKind
from tests.estimator.diagnosis.planted import SIGMA, drive_torque, nominal_fit, quiet
from tests.estimator.physics.bench import (
    ANGLE,
    LOAD_SPEED,
    ONE_MASS,
    SPEED,
    TWIST,
    TWO_MASS,
    exact_states,
    linear_record,
    model,
    random_steps,
)

START = Start(5.0, 0.0, 2.0, 0.0, 2.0)
REST = Start(0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def result() -> FitResult:
    """The true model on two recordings without noise: the motion of the fit is the true one."""
    records = [linear_record(TWO_MASS, drive_torque(seed), START, name=f"run_{seed}") for seed in (1, 2)]
    return fit(make_problem(model(TWO_MASS), records, ()))


@pytest.fixture(scope="module")
def view(result: FitResult) -> Scene:
    return scene(result, SIGMA)


class Candidate(NamedTuple):
    """A law of one element, with the output's answers to it, shape (rows, q)."""

    element: Element
    law: str
    answers: FloatArray


def at(view: Scene, element: Element) -> list[Candidate]:
    pool = candidates(view, element)
    return [Candidate(element, law, pool.of([i])) for i, law in enumerate(pool.laws)]


def everywhere(view: Scene) -> list[Candidate]:
    return [candidate for element in elements(view.result) for candidate in at(view, element)]


@pytest.fixture(scope="module")
def pool(view: Scene) -> list[Candidate]:
    return everywhere(view)


def first(candidate: Candidate, samples: int = 1500) -> FloatArray:
    """Answer of the first recording to the first coefficient."""
    return candidate.answers[:samples, 0]


def between(values: FloatArray) -> FloatArray:
    """A signal in the middle of each period, where a held torque acts; straight on at the end."""
    later = np.append(values[1:], 2.0 * values[-1] - values[-2])
    return 0.5 * (values + later)


def response(drive: FloatArray, load: FloatArray) -> FloatArray:
    """Motor speed of the linear driveline from rest under torques alone."""
    return exact_states(TWO_MASS, drive, REST, extra_load_nm=load)[:, SPEED]


def pick(pool: list[Candidate], element: Element, law: str) -> Candidate:
    (found,) = [c for c in pool if (c.element, c.law) == (element, law)]
    return found


@pytest.mark.parametrize(
    ("element", "law"),
    [
        (Element.TORQUE_PATH, "T |T|"),
        (Element.TORQUE_PATH, "T t"),
        (Element.MOTOR, "w_M |w_M|"),
        (Element.SHAFT, "twist^3"),
        (Element.LOAD, "w_L |w_L|"),
    ],
)
def test_an_answer_is_the_exact_response_per_unit(pool: list[Candidate], element: Element, law: str) -> None:
    states = exact_states(TWO_MASS, drive_torque(1), START)
    torque, time_s = drive_torque(1), np.arange(1500) * 0.01
    speed, load_speed, twist = (between(states[:, i]) for i in (SPEED, LOAD_SPEED, TWIST))
    values = {
        "T |T|": torque * np.abs(torque),
        "T t": torque * time_s,
        "w_M |w_M|": speed * np.abs(speed),
        "twist^3": twist**3,
        "w_L |w_L|": load_speed * np.abs(load_speed),
    }[law]
    nothing = np.zeros_like(values)
    expected = {
        Element.TORQUE_PATH: response(values, nothing),
        Element.MOTOR: response(-values, nothing),
        Element.SHAFT: response(-values, -values),
        Element.LOAD: response(nothing, values),
    }[element]
    answer = first(pick(pool, element, law))
    assert np.max(np.abs(answer - expected)) < 2e-3 * np.ptp(expected)


def test_a_delay_of_one_period_is_the_difference_to_the_torque_before(pool: list[Candidate]) -> None:
    torque = drive_torque(1)
    late = np.concatenate([[torque[0]], torque[:-1]])
    expected = response(late - torque, np.zeros_like(torque))
    answer = first(pick(pool, Element.TORQUE_PATH, "a torque one period late"))
    assert np.max(np.abs(answer - expected)) < 1e-3 * np.ptp(expected)


def test_the_answer_to_an_error_of_the_reading_is_the_error(pool: list[Candidate]) -> None:
    """Waves are in the phase of each recording: cosine and sine of the first, then of the second."""
    states = exact_states(TWO_MASS, drive_torque(1), START)
    turns = [c for c in pool if c.element is Element.SPEED_SENSOR and c.law == "a wave of w 1 times per motor turn"]
    expected = states[:, SPEED] * np.sin(states[:, ANGLE] - states[0, ANGLE])
    assert turns[0].answers.shape == (3000, 4)
    np.testing.assert_allclose(turns[0].answers[:1500, 1], expected, atol=5e-3 * np.ptp(expected))
    assert not turns[0].answers[1500:, :2].any()
    assert not turns[0].answers[:1500, 2:].any()


def test_load_steps_are_on_a_grid_each_in_one_recording(result: FitResult, pool: list[Candidate]) -> None:
    steps = [c for c in pool if c.law.startswith("a load step")]
    per_recording = int(14.99 / STEP_EVERY_S) - 1
    assert len(steps) == 2 * per_recording
    assert len({c.law for c in steps}) == len(steps)
    in_second = [c for c in steps if c.law.endswith("in run_2")]
    assert len(in_second) == per_recording
    for i, candidate in enumerate(in_second, start=1):
        assert candidate.element is Element.LOAD
        moment = round(i * STEP_EVERY_S / 0.01)
        assert not candidate.answers[: 1500 + moment + 1].any()
        load = np.where(np.arange(1500) >= moment, 1.0, 0.0)
        expected = response(np.zeros(1500), load)
        assert np.max(np.abs(candidate.answers[1500:, 0] - expected)) < 5e-3 * np.ptp(expected)


def test_what_sets_in_at_a_moment_does_so_in_one_recording_and_names_it(pool: list[Candidate]) -> None:
    late = pick(pool, Element.LOAD, "dw_L/dt from 5.0 s on in run_2").answers[:, 0]
    early = pick(pool, Element.LOAD, "dw_L/dt from 5.0 s on in run_1").answers[:, 0]
    assert not late[:2001].any()
    assert late[2001:].any()
    assert early[501:1500].any()
    assert not early[1500:].any()


def test_every_input_but_the_last_may_count_more_than_its_reading() -> None:
    shares = np.column_stack([0.3 * drive_torque(1), 0.7 * drive_torque(1) + 20.0, np.full(1500, -20.0)])
    rec = replace(linear_record(TWO_MASS, drive_torque(1), START), torque_nm=shares)
    pool = at(scene(fit(make_problem(model(TWO_MASS), [rec], ())), SIGMA), Element.TORQUE_PATH)
    assert [c.law for c in pool if c.law in ("T_1", "T_2", "T_3")] == ["T_1", "T_2"]
    expected = response(shares[:, 1], np.zeros(1500))
    answer = first(pick(pool, Element.TORQUE_PATH, "T_2"))
    assert np.max(np.abs(answer - expected)) < 1e-3 * np.ptp(expected)


def test_one_mass_has_no_shaft_and_its_load_acts_at_the_motor() -> None:
    rec = linear_record(ONE_MASS, random_steps(600, seed=3), REST)
    view = scene(fit(make_problem(model(ONE_MASS), [rec], ())), SIGMA)
    assert elements(view.result) == (
        Element.TORQUE_PATH,
        Element.MOTOR,
        Element.SPEED_SENSOR,
        Element.ACQUISITION,
    )
    assert {c.element for c in everywhere(view) if c.law.startswith("a load step")} == {Element.MOTOR}


def test_a_position_has_no_error_of_the_speed_reading() -> None:
    rec = linear_record(TWO_MASS, random_steps(600, seed=3), START, kind=OutputKind.POSITION)
    view = scene(fit(make_problem(model(TWO_MASS), [rec], ())), SIGMA)
    assert elements(view.result) == (Element.TORQUE_PATH, Element.MOTOR, Element.SHAFT, Element.LOAD)
    assert everywhere(view)


def test_a_law_that_is_zero_throughout_has_no_answer() -> None:
    """The line stands still but for the noise of nothing: no speed, no friction."""
    rec = linear_record(TWO_MASS, np.zeros(400), REST)
    pool = at(scene(fit(make_problem(model(TWO_MASS), [rec], ())), SIGMA), Element.TORQUE_PATH)
    assert not pick(pool, Element.TORQUE_PATH, "T |T|").answers.any()


def test_a_profile_of_the_fit_continues_in_the_answers() -> None:
    records = quiet()
    line = model(TWO_MASS)
    hill = [
        linear_record(TWO_MASS, r.total_torque_nm, START, extra_load_nm=40.0 * np.sin(0.4 * r.time_s), name=r.name)
        for r in records
    ]
    followed = fit(make_problem(line, hill, (), profile=True))
    assert followed.rms < 0.02 * nominal_fit(hill).rms
    moved = motion_of(followed, 0)
    assert np.max(np.abs(moved.speed - hill[0].output)) < 0.01 * np.ptp(hill[0].output)
    step = pick(at(scene(followed, SIGMA), Element.LOAD), Element.LOAD, "a load step at 5.0 s in run_1")
    expected = response(np.zeros(1500), np.where(np.arange(1500) >= 500, 1.0, 0.0))
    assert np.max(np.abs(first(step) - expected)) < 1e-2 * np.ptp(expected)
