"""The slider against what is known of it: a spring until it yields, and the loop that Masing's rule gives."""

import numpy as np
import pytest

from estimator.signals.record import carried

WIDTH = 2.0


def test_it_is_a_spring_until_it_yields() -> None:
    values = 5.0 + np.linspace(0.0, 0.99 * WIDTH, 40)
    assert carried(values, WIDTH) == pytest.approx(values - 5.0)


def test_it_carries_its_width_and_no_more() -> None:
    values = np.concatenate([np.linspace(0.0, 9.0, 50), np.linspace(9.0, -9.0, 100)])
    found = carried(values, WIDTH)
    assert found.max() == WIDTH
    assert found.min() == -WIDTH


@pytest.mark.parametrize("top", [3.0, 7.5])
def test_back_and_forth_it_yields_twice_its_width_behind_each_turn(top: float) -> None:
    """Masing's rule: from a turn on the loop is the first loading, twice as large."""
    up, down = np.linspace(0.0, top, 301), np.linspace(top, -top, 601)[1:]
    found = carried(np.concatenate([up, down]), WIDTH)[up.size :]
    behind = top - down
    assert found == pytest.approx(WIDTH - np.minimum(behind, 2.0 * WIDTH))


def test_a_single_value_moves_nothing() -> None:
    assert carried(np.array([3.0]), WIDTH).tolist() == [0.0]
