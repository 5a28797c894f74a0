"""The linear driveline against closed solutions: matrix exponential, eigenvalues, energy."""

import numpy as np
from scipy.linalg import expm

from hil.proof.truth.driveline import TruthDriveline


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


def test_one_long_advance_is_many_short_ones(plain):
    once, often = TruthDriveline(plain, 10.0), TruthDriveline(plain, 10.0)
    once.advance((100.0, 60.0), 0.5)
    for _ in range(50):
        often.advance((100.0, 60.0), 0.01)
    np.testing.assert_allclose(once.state, often.state, rtol=1e-12)
