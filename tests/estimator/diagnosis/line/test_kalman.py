"""Filter and smoother against the joint normal distribution of all blocks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from estimator.diagnosis.line.equivalent import Chain, Filtered, run_filter, run_smoother


def test_filter_and_smoother_are_the_conditional_normal_distribution() -> None:
    """Against the joint normal distribution of 30 blocks, inverted as a whole."""
    rng = np.random.default_rng(2)
    blocks, n = 30, 2
    phi = np.array([[0.9, 0.2], [-0.3, 0.8]])
    drive, c, direct = np.array([0.5, 0.1]), np.array([1.0, 0.3]), 0.2
    memory, walk, noise = 0.97, 0.3, 0.1
    weight = np.where(np.arange(blocks) % 7 == 3, 0.0, 2.0)
    f = np.block([[phi, drive[:, None]], [np.zeros((1, n)), np.array([[memory]])]])
    prior = np.diag([1.0, 2.0, 3.0])
    move = np.eye(3 * blocks)
    for b in range(1, blocks):
        move[3 * b : 3 * b + 3] = f @ move[3 * b - 3 : 3 * b]
        move[3 * b : 3 * b + 3, 3 * b : 3 * b + 3] = np.eye(3)
    covariance = move @ block_diag(prior, *[np.diag([0.0, 0.0, walk])] * (blocks - 1)) @ move.T
    seen = np.flatnonzero(weight)
    h = np.zeros((seen.size, 3 * blocks))
    for row, b in enumerate(seen):
        h[row, 3 * b : 3 * b + 3] = [*c, direct]
    spread = h @ covariance @ h.T + 0.5 * noise * np.eye(seen.size)
    error = rng.standard_normal(blocks)
    gain = covariance @ h.T @ np.linalg.inv(spread)
    mean = (gain @ error[seen]).reshape(blocks, 3)
    variance = np.diag(covariance - gain @ h @ covariance).reshape(blocks, 3)
    likelihood = -0.5 * (
        error[seen] @ np.linalg.solve(spread, error[seen])
        + np.linalg.slogdet(spread)[1]
        + seen.size * np.log(2.0 * np.pi)
    )

    chain = Chain(phi[None], drive[None], c[None], np.array([direct]), memory, walk)
    kept = Filtered(
        np.zeros((blocks, 3)), np.zeros((blocks, 3, 3)), np.zeros((blocks, 3)), np.zeros(blocks), np.zeros(blocks)
    )
    estimates, spreads = np.zeros((blocks, 3)), np.zeros(blocks)
    assert run_filter(chain, error, weight, noise, prior, kept) == pytest.approx(likelihood)
    run_smoother(chain, kept, estimates, spreads)
    np.testing.assert_allclose(estimates, mean, atol=1e-9)
    np.testing.assert_allclose(spreads, variance[:, 2], atol=1e-9)
