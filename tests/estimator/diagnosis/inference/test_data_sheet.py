"""A wrong data sheet is no missing physics: values beyond their tolerances are a hypothesis without an effect."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pytest

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.inference.decide import free_lines
from estimator.diagnosis.inference.fits import Fits
from estimator.diagnosis.inference.hypotheses import all_good_samples, open_hypotheses
from estimator.diagnosis.result import Effort, Fit, OffNominal, Verdict
from estimator.diagnosis.wording import Context, statement
from estimator.physics.effect import Element
from estimator.physics.model import DrivelineModel
from tests.estimator.diagnosis.planted import quiet
from tests.estimator.physics.bench import TWO_MASS, model


def off_by(factors: Mapping[str, float], tolerance: float) -> DrivelineModel:
    """A nominal model whose true values are these factors times its own."""
    return model({name: value / factors.get(name, 1.0) for name, value in TWO_MASS.items()}, tolerance)


def searched(factors: Mapping[str, float], tolerance: float = 0.1) -> Fits:
    line, records = off_by(factors, tolerance), quiet()
    return Fits(line, records, all_good_samples(records), open_hypotheses(line, records)[0])


@pytest.mark.parametrize(
    ("name", "factor", "element"),
    [("k", 1.3, Element.SHAFT), ("J_M", 0.8, Element.MOTOR), ("J_L", 1.25, Element.LOAD)],
)
def test_what_left_its_tolerance_is_given_with_its_size_and_place(name: str, factor: float, element: Element) -> None:
    search = searched({name: factor})
    line = free_lines(search)[0]
    (value,) = line.off_nominal
    assert (value.name, value.element, value.tolerance) == (name, element, pytest.approx(0.1))
    assert value.ratio == pytest.approx(factor, rel=0.03)
    assert line.leaves_noise
    assert line.score < search.nothing().score


def test_one_of_two_frictions_that_recordings_tell_by_their_sum_is_off_alone() -> None:
    """Freed together neither clearly leaves its tolerance, and a law of friction would be named for either."""
    line = free_lines(searched({"b_M": 2.8}))[0]
    (value,) = line.off_nominal
    assert value.name == "b_M"
    known_to = 0.1 * TWO_MASS["b_L"] / (TWO_MASS["b_M"] / 2.8)  # the other one may have what is within its tolerance
    assert value.ratio == pytest.approx(2.8, abs=known_to)
    assert line.leaves_noise


def test_inside_its_tolerances_nothing_is_beyond() -> None:
    assert free_lines(searched({"k": 1.08})) == []


@pytest.mark.parametrize(("k", "is_torque"), [(0.47, True), (1.3, False)])
def test_values_off_by_one_factor_are_a_torque_that_was_not_read(k: float, is_torque: bool) -> None:
    off = [OffNominal("J_M", 0.5, 0.1), OffNominal("J_L", 0.49, 0.1), OffNominal("k", k, 0.1)]
    fit = Fit("rad/s", 1.0, 0.1, 0.1, 0.1, 0.1, 0.1)
    text = statement(Verdict.UNEXPLAINED, fit, (), Effort(), Context(off_nominal=off))
    assert ("a torque of 2.1 times what was read: check first that every input is recorded" in text) is is_torque


@pytest.mark.campaign
def test_a_wrong_stiffness_is_no_missing_physics() -> None:
    found = diagnose(quiet(), off_by({"k": 1.3}, 0.05))
    assert [value.name for value in found.off_nominal] == ["k"]
    assert (found.verdict, found.effects) == (Verdict.UNEXPLAINED, ())
    assert found.mismatch.element is Element.SHAFT
    assert "No physics need be missing, but the data sheet is off" in found.statement
    assert re.search(r"k is \S+ Nm/rad, the data sheet says \S+ ± 5 %", found.statement)
