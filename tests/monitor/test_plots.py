"""Text plots: dots where the values are, axes that hold them, lines that fit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.monitor.plot import Canvas, Ring, envelope, nice_range


@pytest.mark.parametrize(
    ("x", "y", "shown"),
    [(0, 0, "⠁"), (1, 0, "⠈"), (0, 1, "⠂"), (0, 3, "⡀"), (1, 3, "⢀")],  # Unicode: dots 1, 4, 2, 7, 8
)
def test_each_dot_of_a_cell(x: int, y: int, shown: str) -> None:
    canvas = Canvas(1, 1)
    canvas.dot(x, y)
    assert canvas.lines() == [shown]


def test_an_envelope_shows_a_single_peak_among_many_samples() -> None:
    y = np.zeros(10_000)
    y[4321] = 7.0
    found = envelope(np.linspace(0.0, 99.0, y.size), y, 100)
    assert max(high for _, _, high in found) == 7.0
    assert [column for column, _, _ in found] == list(range(100))


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20), st.floats(1e-3, 1e3))
def test_an_axis_holds_all_values_and_not_much_more(values: list[float], least: float) -> None:
    y_range = nice_range(np.array(values), least)
    span = max(max(values) - min(values), least)
    slack = 1e-6 * max(1.0, *(abs(value) for value in values))
    assert y_range.low <= min(values) + slack
    assert y_range.high >= max(values) - slack
    assert y_range.high - y_range.low <= 1.7 * span + slack  # two steps of at most 2.5 eighths each, at most


@given(st.integers(1, 30), st.integers(0, 200))
def test_a_ring_keeps_the_last_rows(length: int, rows: int) -> None:
    ring = Ring(length, 2)
    for k in range(rows):
        ring.append((float(k), float(-k)))
    kept = np.arange(max(0, rows - length), rows, dtype=float)
    np.testing.assert_array_equal(ring.rows(), np.column_stack([kept, -kept]))
