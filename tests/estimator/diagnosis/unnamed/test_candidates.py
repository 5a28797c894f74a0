"""The output's answer to a law, against the exact response of a linear driveline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from estimator.diagnosis.unnamed.forms import STEP_EVERY_S, candidates
from estimator.diagnosis.unnamed.scene import Scene, elements, scene
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.physics.fit import FitResult, fit
from estimator.physics.problem import make_problem
from estimator.signals.record import FloatArray
from tests.estimator.diagnosis.planted import SIGMA, drive_torque
from tests.estimator.physics.bench import (
    LOAD_SPEED,
    SPEED,
    TWIST,
    TWO_MASS,
    exact_states,
    linear_record,
    model,
)

START = InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0)
REST = InitialCondition(0.0, 0.0, 0.0)


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
