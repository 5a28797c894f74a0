"""Recordings are compared with each other: who is not of the line of the others is named, by how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.preconditions.agreement import disagreements, is_answered
from estimator.diagnosis.result import Doubt, Estimated, Evidence, FoundEffect
from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from estimator.signals.record import Record
from tests.estimator.diagnosis.planted import SIGMA, disturbed, drive_torque
from tests.estimator.diagnosis.test_preconditions_units import LAWS
from tests.estimator.physics.bench import TWO_MASS, linear_record, model, random_steps, record, scaled

SAMPLES = 2000


def drive(name: str, gain: float = 1.0, **factors: float) -> Record:
    torque = random_steps(SAMPLES, seed=ord(name), hold=20)
    start = InitialCondition(10.0, 0.0, 20.0, 0.0, 20.0)
    found = linear_record(scaled(TWO_MASS, **factors), torque, start, sigma=0.02, name=name)
    return replace(found, torque_nm=gain * found.torque_nm)


def asked(*records: Record) -> list[Doubt]:
    return disagreements(records, model(TWO_MASS))


@pytest.mark.parametrize(("name", "factor"), [("k", 0.6), ("J_L", 1.7), ("J_M", 1.6)])
def test_the_one_that_is_of_another_line_is_named_by_how_much(name: str, factor: float) -> None:
    (doubt,) = asked(drive("a"), drive("b"), drive("d", **{name: factor}))
    assert doubt.about == "d"
    assert f"its {name} fits " in doubt.statement
    said = float(doubt.statement.split(f"its {name} fits ")[1].split()[0])
    assert said == pytest.approx(factor, rel=0.2)
    assert "To diagnose the rest alone, leave out d." in doubt.statement


def test_recordings_of_one_line_agree() -> None:
    assert asked(drive("a"), drive("b"), drive("d")) == []


def test_of_two_it_is_not_said_which() -> None:
    (doubt,) = asked(drive("a"), drive("b", k=0.6))
    assert doubt.about == "a, b"
    assert "leave out b, or a." in doubt.statement


def test_all_of_a_line_by_one_factor_is_the_torque() -> None:
    (doubt,) = asked(drive("a"), drive("b"), drive("d", gain=1.5))
    assert "as under a torque of" in doubt.statement


@pytest.mark.parametrize("law", LAWS)
def test_missing_physics_is_no_disagreement_however_large_the_torque(law: str) -> None:
    seen = []
    for seed, size in enumerate((0.4, 1.0, 1.5)):
        torque = size * drive_torque(seed)
        speed = disturbed(*LAWS[law], torque, InitialCondition(10.0, 0.0, 20.0, 0.0, 20.0))
        speed = speed + SIGMA * np.random.default_rng(seed).standard_normal(speed.size)
        seen.append(record(torque, speed, name=f"run_{seed}"))
    assert asked(*seen) == []


def test_one_that_tells_no_line_is_not_compared() -> None:
    still = replace(drive("d"), output=0.02 * np.random.default_rng(1).standard_normal(SAMPLES))
    assert asked(drive("a"), still) == []


def crack(change: float, begins_s: float) -> FoundEffect:
    """Return a stiffness that changes in ``b``, and stays so in ``d``."""
    moments = {"b": ((begins_s, 20.0),), "d": ((0.0, 20.0),)}
    size = {"change": Estimated(change, (change, change), "")}
    return FoundEffect("stiffness_change", Element.SHAFT, "", size, moments, (), Evidence(0.0, 1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("change", "begins_s", "answered"), [(-0.4, 9.0, True), (-0.4, 0.0, False), (-0.1, 9.0, False), (0.7, 9.0, True)]
)
def test_a_change_seen_as_it_happens_answers_what_recordings_differ_by(
    change: float, begins_s: float, answered: bool
) -> None:
    records = [drive("a"), drive("b"), drive("d", k=0.6)]
    (doubt,) = asked(*records)
    assert is_answered(doubt, [crack(change, begins_s)], model(TWO_MASS), TWO_MASS, records) is answered


def test_another_parameter_answers_nothing() -> None:
    records = [drive("a"), drive("b"), drive("d", J_L=1.7)]
    (doubt,) = asked(*records)
    assert not is_answered(doubt, [crack(-0.4, 9.0)], model(TWO_MASS), TWO_MASS, records)
