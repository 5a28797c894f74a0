"""What is usual: level and spread of blocks, for any strength of the excitation."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.identification.tracking.watch import Baseline, Spread, spread_of

NUMBER = np.arange(2.0, 23.0)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_drift_is_no_spread(slope: float) -> None:
    rng = np.random.default_rng(3)
    spreads = [spread_of(NUMBER, slope * NUMBER + rng.normal(0.0, 0.5, 21), np.full(21, 4.0)) for _ in range(400)]
    assert np.sqrt(np.mean([spread.of_x**2 for spread in spreads])) == pytest.approx(1.0, rel=0.05)
    assert spreads[0].usual == 4.0


def test_level_weighs_blocks_by_their_information() -> None:
    level = Baseline.of(np.array([1.0, 4.0]), np.array([2.0, 1.0]))
    assert level == Baseline(2.0, 3.0)


@pytest.mark.parametrize(("information", "std_hz"), [(1.0, 1.0), (0.25, 2.0), (16.0, 1.0)])
def test_neither_a_weaker_nor_a_stronger_excitation_is_judged_too_sharply(information: float, std_hz: float) -> None:
    """Noise spreads the weaker one's frequencies more; what the model lacks spreads the stronger one's no less."""
    statistic = Baseline(0.0, 1e12).statistic(3.0, information, 0.5, Spread(1.0, 1.0))
    assert statistic == pytest.approx(2.5 / std_hz)


def test_what_is_tolerated_counts_as_nothing() -> None:
    level, spread = Baseline(8.0, 7.0), Spread(0.1, 1.0)
    assert level.statistic(8.07, 1.0, 0.08, spread) == 0.0
    assert level.statistic(7.9, 1.0, 0.08, spread) < 0.0 < level.statistic(8.1, 1.0, 0.08, spread)
