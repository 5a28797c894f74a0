"""The yardsticks of these tests, against closed formulas."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.physics.driveline import InitialCondition
from estimator.physics.effect import Element
from tests.estimator.diagnosis.planted import SIGMA, disturbed, quiet, rubbing_speed
from tests.estimator.physics.bench import ONE_MASS, SAMPLE_TIME_S, SPEED, TWO_MASS, exact_states, random_steps


def test_where_nothing_is_planted_the_recordings_are_the_linear_line_and_noise() -> None:
    rec = quiet((1,))[0]
    exact = exact_states(TWO_MASS, rec.total_torque_nm, InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0))[:, SPEED]
    assert np.std(rec.output - exact) == pytest.approx(SIGMA, rel=0.1)


def test_viscous_friction_planted_is_more_of_it_in_the_line() -> None:
    """By fixed-point iteration; held over each period it comes half a period late, which costs a few per cent."""
    torque, start = random_steps(600, 1), InitialCondition(5.0, 0.0, 2.0, 0.0, 2.0)
    planted = disturbed(Element.MOTOR, lambda moved: moved.speed, 0.2, torque, start)
    exact = exact_states(TWO_MASS | {"b_M": TWO_MASS["b_M"] + 0.2}, torque, start)[:, SPEED]
    plain = exact_states(TWO_MASS, torque, start)[:, SPEED]
    assert np.max(np.abs(planted - exact)) < 0.2 * np.max(np.abs(plain - exact))


def test_a_rubbing_mass_coasts_to_the_stop_of_the_closed_formula() -> None:
    """w(t) = (w_0 + T_c/b) exp(-b t/J) - T_c/b until it stops, and then it stays."""
    friction, w_0 = 12.0, 3.0
    speed = rubbing_speed(lambda w: friction, np.zeros(800), InitialCondition(0.0, 0.0, w_0), substeps=100)
    b, j = ONE_MASS["b_M"], ONE_MASS["J_M"]
    time_s = np.arange(800) * SAMPLE_TIME_S
    expected = np.maximum((w_0 + friction / b) * np.exp(-b / j * time_s) - friction / b, 0.0)
    np.testing.assert_allclose(speed, expected, atol=1e-3)
    assert speed[-1] == 0.0


def test_without_friction_it_is_the_linear_mass() -> None:
    torque, start = random_steps(600, 2), InitialCondition(5.0, 0.0, 2.0)
    speed = rubbing_speed(lambda w: 0.0, torque, start)
    np.testing.assert_allclose(speed, exact_states(ONE_MASS, torque, start)[:, SPEED], atol=1e-9)
