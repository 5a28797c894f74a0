"""The linear driveline against closed solutions: matrix exponential, eigenvalues, energy."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

from hil.proof.truth.driveline import TruthDriveline
from hil.proof.truth.physics import State


def _system(p):
    """States [phi_M, phi_L, w_M, w_L], input torque."""
    A = np.array(
        [
            [0, 0, 1, 0],
            [0, 0, 0, 1],
            [-p.k / p.J_M, p.k / p.J_M, -(p.c + p.b_M) / p.J_M, p.c / p.J_M],
            [p.k / p.J_L, -p.k / p.J_L, p.c / p.J_L, -(p.c + p.b_L) / p.J_L],
        ]
    )
    return A, np.array([0, 0, 1 / p.J_M, 0])


def _sampled(p, period_s):
    A, b = _system(p)
    joined = np.zeros((5, 5))
    joined[:4, :4], joined[:4, 4] = A, b
    whole = expm(joined * period_s)
    return whole[:4, :4], whole[:4, 4]


def test_follows_the_matrix_exponential_under_held_torques(plain, trace):
    rng = np.random.default_rng(1)
    torques = 150.0 * rng.choice([-1.0, 1.0], 500)
    states = trace(plain, torques)
    Phi, gamma = _sampled(plain, 0.01)
    x = np.zeros(4)
    for k, torque in enumerate(torques):
        np.testing.assert_allclose(states[k, :4], x, rtol=0, atol=2e-4)
        x = Phi @ x + gamma * torque


def test_rings_at_the_eigenfrequency_and_dies_away_at_its_rate(plain, trace):
    states = trace(plain, [400.0] * 5 + [0.0] * 4000, period_s=0.001)
    speed = states[5:, State.SPEED_M] - states[5:, State.SPEED_L]
    A, _ = _system(plain)
    mode = max(np.linalg.eigvals(A), key=lambda value: value.imag)
    up = np.flatnonzero((speed[:-1] < 0) & (speed[1:] >= 0))
    crossing = (up - speed[up] / (speed[up + 1] - speed[up])) * 0.001
    assert 2 * np.pi / np.diff(crossing).mean() == pytest.approx(mode.imag, rel=1e-4)
    peaks = np.array([speed[a:b].max() for a, b in pairwise(up)])
    rate = np.polyfit(crossing[:-1], np.log(peaks), 1)[0]
    assert rate == pytest.approx(mode.real, rel=1e-3)


def test_keeps_its_energy_when_nothing_takes_it(lossless, trace, twist):
    states = trace(lossless, [300.0] * 10 + [0.0] * 2000)[10:]
    kinetic = 0.5 * (lossless.J_M * states[:, State.SPEED_M] ** 2 + lossless.J_L * states[:, State.SPEED_L] ** 2)
    energy = kinetic + 0.5 * lossless.k * twist(states) ** 2
    np.testing.assert_allclose(energy, energy[0], rtol=5e-6)


def test_momentum_changes_by_the_outer_torques_alone(lossless, trace):
    states = trace(lossless._replace(load_torque_nm=50.0), [120.0] * 1000)
    momentum = lossless.J_M * states[:, State.SPEED_M] + lossless.J_L * states[:, State.SPEED_L]
    np.testing.assert_allclose(momentum, 70.0 * states[:, State.TIME_S], atol=1e-6)


def test_one_long_advance_is_many_short_ones(plain):
    once, often = TruthDriveline(plain, 10.0), TruthDriveline(plain, 10.0)
    once.advance((100.0, 60.0), 0.5)
    for _ in range(50):
        often.advance((100.0, 60.0), 0.01)
    np.testing.assert_allclose(once.state, often.state, rtol=1e-12)


def test_no_time_is_no_change(plain):
    driveline = TruthDriveline(plain, 10.0)
    before = driveline.state
    driveline.advance((100.0, 60.0), 0.0)
    np.testing.assert_array_equal(driveline.state, before)
