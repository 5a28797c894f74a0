"""Delay and lag between torque reading and shaft, against closed formulas."""

import numpy as np
import pytest
from scipy.linalg import expm

from estimator.physics.driveline import InitialCondition
from estimator.physics.effects import timing
from estimator.physics.effects.timing import lag_step, low_pass
from estimator.physics.layout import Grid, flat
from estimator.physics.simulate import simulate
from estimator.signals.record import FloatArray
from tests.chosen import campaign
from tests.estimator.physics.bench import SAMPLE_TIME_S, model, random_steps, record

REST = InitialCondition(0.0, 0.0, 0.0)
INTEGRATOR = {"J_M": 2.0, "b_M": 0.0}


def run(effects: dict[str, dict[str, float]], torque: FloatArray, substeps: int) -> FloatArray:
    line = model(INTEGRATOR, effects=effects)
    return simulate(Grid(line.structure, substeps, 1e-3), record(torque), flat(line), REST)


def delayed(samples: float, torque: FloatArray, substeps: int = 4) -> FloatArray:
    return run({"transport_delay": {"delay_s": samples * SAMPLE_TIME_S}}, torque, substeps)


@pytest.mark.parametrize("substeps", [1, 3, 4])
@pytest.mark.parametrize("fraction", [0.25, 0.5, 0.9])
def test_a_fractional_delay_of_an_integrator_lies_between_in_proportion(fraction: float, substeps: int) -> None:
    torque = random_steps(300, seed=2, hold=3)
    expected = (1.0 - fraction) * delayed(1, torque) + fraction * delayed(2, torque)
    np.testing.assert_allclose(delayed(1 + fraction, torque, substeps), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("start", "length", "mean", "jump", "share"),
    [
        (0.0, 1.0, 1.0, 0.0, 0.0),
        (0.25, 0.5, 1.0, 0.0, 0.0),
        (0.5, 1.0, 1.5, 1.0, 0.5),  # half of 1 and half of 2
        (1.75, 1.0, 3.5, 2.0, 0.75),  # a quarter of 2 and three quarters of 4
        (1.9, 0.2, 3.0, 2.0, 0.5),
        (-3.0, 1.0, 7.0, 0.0, 0.0),  # before the first sample
        (-0.5, 1.0, 4.0, -6.0, 0.5),  # half of 7 and half of 1
        (2.5, 0.5, 4.0, 0.0, 0.0),
        (5.5, 0.5, 4.0, 0.0, 0.0),  # after the last
    ],
)
def test_a_held_torque_as_a_line(start: float, length: float, mean: float, jump: float, share: float) -> None:
    """The rise is that of the line with the jump's first moment, integral of ``jump (r - 1/2)`` behind the jump."""
    moment = jump * 0.5 * (share - share**2)
    expected = (mean, 12.0 * moment)  # a line of rise R has the first moment R / 12
    found = timing.delayed(np.array([1.0, 2.0, 4.0]), 7.0, start, length)
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("shape", [0.04, campaign(0.25), 0.5])
@pytest.mark.parametrize("length_s", [campaign(0.001), 0.02, campaign(5.0)])
def test_a_lagged_step_of_second_order_is_the_matrix_exponential(shape: float, length_s: float) -> None:
    tau, torque, lagged, rising = 0.03, 40.0, 10.0, 25.0
    mean, rise, end, risen = lag_step(torque, 0.0, lagged, rising, low_pass(tau, shape, length_s))
    place = (np.arange(2000) + 0.5) / 2000
    law = np.array([[0.0, 1.0], [-1.0 / shape, -1.0 / shape]]) * length_s / tau
    off = expm(place[:, None, None] * law) @ [lagged - torque, rising]
    torques = torque + off[:, 0]
    last = expm(law) @ [lagged - torque, rising]
    np.testing.assert_allclose([end - torque, risen], last, rtol=1e-9, atol=1e-9)
    assert mean == pytest.approx(float(np.mean(torques)), rel=1e-3)
    assert rise == pytest.approx(12.0 * float(np.mean(torques * (place - 0.5))), rel=1e-3)


def test_what_came_before_a_recording_is_delayed_into_it() -> None:
    """The reading is 30 Nm from its first sample on; 50 Nm acted before, and still act for as long as the delay."""
    torque = np.full(50, 30.0)
    speed = run({"transport_delay": {"delay_s": 0.055, "before_nm": 20.0}}, torque, 4)
    time_s = np.arange(50) * SAMPLE_TIME_S
    expected = (30.0 * time_s + 20.0 * np.minimum(time_s, 0.055)) / INTEGRATOR["J_M"]
    np.testing.assert_allclose(speed, expected, rtol=0, atol=1e-10)
