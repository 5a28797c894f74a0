"""The rates of a simulated output on both sides of each sample, against laws that can be written down."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.physics.driveline import Start
from estimator.physics.fit import FitResult, fit, rates
from estimator.physics.model import DrivelineModel, Parameter, Structure
from estimator.physics.problem import make_problem
from estimator.physics.unknowns import nominal_unknowns
from estimator.signals.record import FloatArray, OutputKind, Record
from tests.estimator.physics.bench import ONE_MASS, SAMPLE_TIME_S, linear_record, model, random_steps

TORQUE_NM = random_steps(400, 1)
START = Start(5.0, 0.0, 20.0)


def fitted(record: Record, line: DrivelineModel) -> FitResult:
    return fit(make_problem(line, [record], nominal_unknowns(line)))


def test_of_one_mass_the_acceleration_before_and_after_a_torque_steps() -> None:
    """Newton's law with the torque that was, and with the one that comes; within a sub-step's share of J / b = 5 s."""
    line = model(ONE_MASS, tolerance=0.0)
    found = fitted(linear_record(ONE_MASS, TORQUE_NM, START), line)
    ((before, after),) = rates(found)
    drag = ONE_MASS["b_M"] * found.outputs[0] + START.load_torque_nm
    assert after == pytest.approx((TORQUE_NM - drag) / ONE_MASS["J_M"], rel=2e-3)
    was = np.append(TORQUE_NM[0], TORQUE_NM[:-1])
    assert before == pytest.approx((was - drag) / ONE_MASS["J_M"], rel=2e-3)


def test_of_a_position_the_speed_on_both_sides() -> None:
    """Within what the speed, 10 rad/s^2 at most, changes by in a sub-step."""
    line = model(ONE_MASS, tolerance=0.0)
    found = fitted(linear_record(ONE_MASS, TORQUE_NM, START, kind=OutputKind.POSITION), line)
    ((before, after),) = rates(found)
    assert before == pytest.approx(after, abs=0.1)
    assert after[:-1] == pytest.approx(np.diff(found.outputs[0]) / SAMPLE_TIME_S, abs=0.1)


def test_of_a_joint_straight_lines_to_the_neighbours() -> None:
    stiffness, time_s = 100.0, SAMPLE_TIME_S * np.arange(300)
    twist: FloatArray = 0.1 * np.sin(3.0 * time_s)
    line = DrivelineModel(Structure.JOINT, {"k": Parameter(stiffness, 0.0), "c": Parameter(0.0, 0.0)})
    record = Record(
        "bench",
        SAMPLE_TIME_S,
        time_s,
        (stiffness * twist)[:, None],
        stiffness * twist,
        np.ones(300, dtype=bool),
        OutputKind.FORCE,
        imposed=twist,
    )
    ((before, after),) = rates(fitted(record, line))
    secants = stiffness * np.diff(twist) / SAMPLE_TIME_S
    assert after[:-1] == pytest.approx(secants, abs=1e-6)
    assert before[1:] == pytest.approx(secants, abs=1e-6)
    assert before[0] == after[0]
    assert after[-1] == before[-1]
