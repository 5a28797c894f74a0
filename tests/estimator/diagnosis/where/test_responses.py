"""The response of recording and models: a wrong stiffness shows, the true one does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimator.diagnosis.where.locate import responses
from estimator.physics.driveline import Start
from estimator.physics.fit import fit
from estimator.physics.problem import make_problem
from tests.estimator.diagnosis.planted import SIGMA, drive_torque
from tests.estimator.physics.bench import TWO_MASS, linear_record, model

START = Start(5.0, 0.0, 2.0, 0.0, 2.0)


def test_a_softer_shaft_is_seen_in_the_response_and_the_true_one_is_not() -> None:
    rec = linear_record(TWO_MASS, drive_torque(1, 6000), START, sigma=SIGMA, seed=4)
    true = fit(make_problem(model(TWO_MASS), [rec], ()))
    soft = fit(make_problem(model({**TWO_MASS, "k": 0.8 * TWO_MASS["k"]}), [rec], ()))
    (response,) = responses(soft, true).values()
    assert response.p_before < 1e-6
    assert response.p_after > 0.01
    inside = np.abs(np.abs(response.after) - np.abs(response.measured)) <= 1.96 * response.std
    assert inside.mean() > 0.85


def test_a_recording_without_unbroken_segments_has_no_response() -> None:
    rec = linear_record(TWO_MASS, drive_torque(1), START, sigma=SIGMA, seed=4)
    okay = np.arange(rec.okay.size) % 100 >= 5  # gaps of 50 ms are too long to bridge, 0.95 s too short for a segment
    result = fit(make_problem(model(TWO_MASS), [replace(rec, okay=okay)], ()))
    assert responses(result, result) == {}
