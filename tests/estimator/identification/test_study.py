"""An identification, questioned: what it says where all is well, and where something is not."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.errors import BadModel
from estimator.identification.identify import compare, identify, study
from estimator.identification.online.ekf import TwoMass
from estimator.identification.online.estimators import ESTIMATORS
from estimator.identification.settings import Settings
from estimator.signals.record import Record
from tests.estimator.identification.driveline import B_L, B_M, J_L, J_M, C, K, cruise, true_resonance

SETTINGS = Settings()


@pytest.fixture(scope="module")
def record() -> Record:
    return cruise(5).record


def test_a_good_run_is_sure_of_its_resonance_and_of_the_motor(record: Record) -> None:
    found = identify(record, SETTINGS)
    asked = study(record, found, SETTINGS)
    assert asked.resonance is not None
    assert asked.resonance.frequency_hz.value == pytest.approx(true_resonance()[0], rel=0.01)
    assert asked.validation.unseen == ()
    assert asked.feedback is not None
    assert not asked.feedback.detected
    assert asked.physical is not None
    assert asked.physical.parameters["J_M"].estimate.value == pytest.approx(J_M, rel=0.05)
    assert asked.not_physical == ""


@pytest.mark.campaign
def test_the_course_is_the_on_line_estimate_itself(record: Record) -> None:
    found = identify(record, SETTINGS)
    course = study(record, found, SETTINGS).course
    n = len(found.trajectory)
    np.testing.assert_array_equal(course.estimates.theta[:n], found.trajectory.theta)
    assert len(course) == found.data.okay.shape[0]


@pytest.mark.campaign
def test_a_drive_that_answers_the_wrong_way_round_has_no_masses(record: Record) -> None:
    reversed_sign = replace(record, output=-record.output)
    asked = study(reversed_sign, identify(reversed_sign, SETTINGS), SETTINGS)
    assert asked.physical is None
    assert "sign" in asked.not_physical


def test_an_estimator_of_masses_takes_the_samples_as_they_were_recorded(record: Record) -> None:
    found = identify(record, SETTINGS)
    start = TwoMass(1.3 * J_M, 0.8 * J_L, 0.9 * K, 1.2 * C, B_M, B_L)
    companion = compare(record, found, SETTINGS, "ekf", ESTIMATORS["ekf"], start)
    assert companion.resonance is not None
    assert companion.resonance.frequency_hz == pytest.approx(true_resonance()[0], rel=0.05)
    with pytest.raises(BadModel, match="start values"):
        compare(record, found, SETTINGS, "ekf", ESTIMATORS["ekf"])
