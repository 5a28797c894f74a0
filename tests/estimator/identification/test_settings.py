"""Excitation that determines a model, or not."""

import numpy as np
import pytest

from estimator.errors import NotExciting
from estimator.identification.linear_model import Orders
from estimator.identification.settings import excitation_order, require_excitation
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import FloatArray

N = 600
T = np.arange(N)
ORDERS = Orders(4, 4, 1)


def refused(u: FloatArray, y: FloatArray | None = None, good: int = N) -> NotExciting:
    okay = T < good
    output = np.random.default_rng(0).normal(size=N) if y is None else y
    with pytest.raises(NotExciting) as refusal:
        require_excitation("run_7", u, output, okay, ORDERS)
    assert "run_7" in str(refusal.value)
    return refusal.value


@pytest.mark.parametrize(
    ("u", "order"),
    [
        (np.zeros(N), 0),
        (np.full(N, 3.0), 1),
        (np.sin(0.3 * T), 2),
        (2.0 + np.sin(0.3 * T), 3),
        (np.sin(0.3 * T) + 0.1 * np.sin(1.1 * T + 1), 4),
        (prbs_nm(N, 60.0, cells=3), 7),
        (prbs_nm(N, 60.0), 8),
    ],
)
def test_the_order_is_that_of_the_textbook(u: FloatArray, order: int) -> None:
    assert excitation_order(u, 8) == order


def test_a_prbs_that_moves_the_output_is_enough() -> None:
    require_excitation("run_7", prbs_nm(N, 60.0), np.sin(T), T < 80, ORDERS)


def test_a_sine_leaves_all_but_two_undetermined() -> None:
    assert refused(np.sin(0.3 * T)).names == ("a_2", "a_3", "a_4", "b_2", "b_3", "b_4")


def test_too_few_good_samples_are_refused() -> None:
    refusal = refused(prbs_nm(N, 60.0), good=79)
    assert "79 good samples, expected at least 80" in str(refusal)
    assert refusal.names == ORDERS.names


def test_an_output_that_never_moves_is_refused() -> None:
    refusal = refused(prbs_nm(N, 60.0), y=np.full(N, 120.0))
    assert "never changes" in str(refusal)
    assert refusal.names == ORDERS.names
