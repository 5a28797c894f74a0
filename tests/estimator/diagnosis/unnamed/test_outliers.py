"""Single readings that are off, among swings and noise."""

from __future__ import annotations

import numpy as np

from estimator.diagnosis.unnamed.search import outliers


def test_strays_are_distinguished_from_a_swing_and_from_noise() -> None:
    rng = np.random.default_rng(3)
    time_s = np.arange(0.0, 30.0, 0.01)
    error = 0.2 * np.sin(2 * np.pi * 1.0 * time_s) + 0.02 * rng.standard_normal(time_s.size)
    assert not outliers([error])[0].any()
    for seed in range(10):
        assert not outliers([np.random.default_rng(seed).standard_normal(9000)])[0].any()
    error[[100, 2000]] += [0.6, -0.6]
    assert np.flatnonzero(outliers([error])[0]).tolist() == [100, 2000]
