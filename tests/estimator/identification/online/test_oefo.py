import math

import numpy as np
import pytest
from scipy.signal import lfilter

from estimator.compiled import compiled_with_lock
from estimator.errors import BadModel
from estimator.identification.linear_model import LinearModel, Orders
from estimator.identification.online.adaptation import ConstantForgetting, DecreasingGain
from estimator.identification.online.estimators import Oefo
from estimator.identification.online.recursive import Reason, Status
from estimator.identification.online.regression import is_stable
from estimator.signals.prbs import prbs_nm
from estimator.signals.record import BoolArray, FloatArray

TRUTH = LinearModel(a=(-1.2, 0.85), b=(0.5, 0.3), nk=1, sample_time_s=0.02)
ORDERS = TRUTH.orders
Data = tuple[FloatArray, FloatArray, BoolArray]


def data(n: int = 1500, noise: float = 0.1, seed: int = 0) -> Data:
    u = prbs_nm(n, 1.0, seed=seed + 1)
    y = TRUTH.simulate(u) + noise * np.random.default_rng(seed).normal(size=n)
    return u, y, np.ones(n, dtype=bool)


def textbook(u: FloatArray, y: FloatArray, L: FloatArray, orders: Orders, start_up: int = 0) -> FloatArray:
    """Equations (1) to (7) with whole signals and matrices; decreasing gain; theta after each sample."""
    na, nb, nk = orders.na, orders.nb, orders.nk
    theta, information = np.zeros(na + nb), np.eye(na + nb) / 1000
    y_hat, history = np.zeros(u.shape[0]), []
    u_f = lfilter([1.0], L, u)
    for t in range(u.shape[0]):
        y_hat_f = lfilter([1.0], L, y_hat[:t]) if t else np.zeros(0)

        def lag(x: FloatArray, k: int, t: int = t) -> float:
            return float(x[t - k]) if t >= k else 0.0

        phi = np.array([-lag(y_hat, i + 1) for i in range(na)] + [lag(u, nk + j) for j in range(nb)])  # (3)
        Phi = np.array([-lag(y_hat_f, i + 1) for i in range(na)] + [lag(u_f, nk + j) for j in range(nb)])  # (7)
        if t < start_up:
            Phi = phi
        F = np.linalg.inv(information)
        e_prior = y[t] - theta @ phi  # (1)
        e_post = e_prior / (1 + Phi @ F @ Phi)  # (6)
        theta = theta + F @ Phi * e_post  # (4)
        information = information + np.outer(Phi, Phi)  # (5), lambda_1 = lambda_2 = 1
        y_hat[t] = theta @ phi
        history.append(theta)
    return np.array(history)


@pytest.mark.parametrize("start_up", [0, 25])
@pytest.mark.parametrize(
    ("L", "orders"),
    [
        ([1.0], ORDERS),
        ([1.0, -1.1, 0.8], ORDERS),
        ([1.0, -0.9], Orders(3, 2, 1)),
        ([1.0, -1.1, 0.8], Orders(2, 3, 2)),
        ([1.0, -1.1, 0.8], Orders(2, 3, 0)),
        ([1.0, -0.5, 0.1, 0.02, 0.01], Orders(1, 1, 1)),
    ],
)
def test_equals_the_equations_written_plainly(L: list[float], orders: Orders, start_up: int) -> None:
    u, y, okay = data(250)
    estimator = Oefo(np.array(L), orders, DecreasingGain(), start_up_samples=start_up)
    expected = textbook(u, y, np.array(L), orders, start_up)
    np.testing.assert_allclose(estimator.run(u, y, okay).theta, expected, rtol=1e-6, atol=1e-8)


def test_without_outputs_in_the_regressor_it_is_batch_least_squares() -> None:
    u, y, okay = data(400)
    orders = Orders(na=0, nb=5, nk=1)
    estimator = Oefo(np.ones(1), orders, DecreasingGain())
    estimator.run(u, y, okay)
    rows = np.column_stack([np.concatenate([np.zeros(k), u[:-k]]) for k in range(1, 6)])
    weighed = np.vstack([rows, np.eye(5) / math.sqrt(1000)])  # F(0) = 1000 I is a prior of that weight
    batch = np.linalg.lstsq(weighed, np.concatenate([y, np.zeros(5)]), rcond=None)[0]
    np.testing.assert_allclose(estimator.theta, batch, rtol=1e-9)


def test_an_input_that_is_no_number_is_held_and_masks_until_it_has_left_the_regressor() -> None:
    u, y, okay = data(300)
    u[150] = np.nan
    block = Oefo(TRUTH.A, ORDERS).run(u, y, okay)
    assert np.flatnonzero(~block.used).tolist() == [150, 151, 152]  # held at 150; in phi with lags 1 and 2
    assert np.isfinite(block.theta).all()


def test_forgetting_without_excitation_takes_the_status_back() -> None:
    u, y, okay = data(300)
    estimator = Oefo(np.ones(1), ORDERS, ConstantForgetting(0.98))
    assert estimator.run(u, y, okay)[299].status is Status.ESTIMATED
    quiet = np.zeros(3000)
    assert estimator.run(quiet, quiet, np.ones(3000, dtype=bool))[2999].reason is Reason.NOT_EXCITED
    assert np.isfinite(estimator.F).all()


def test_an_unstable_estimate_is_invalid_and_the_prediction_does_not_run_away() -> None:
    unstable = LinearModel(a=(-1.9, 0.95), b=(1.0, 0.2), nk=1, sample_time_s=0.02)
    growing = LinearModel(a=(-2.02, 1.03), b=(1.0, 0.2), nk=1, sample_time_s=0.02)
    u = prbs_nm(400, 1.0)
    y = np.concatenate([unstable.simulate(u[:100]), growing.simulate(u[100:])])
    block = Oefo(np.ones(1), ORDERS, ConstantForgetting(0.95)).run(u, y, np.ones(400, dtype=bool))
    codes = set(block.reason.tolist())
    assert Reason.UNSTABLE in codes
    assert Reason.UNSTABLE.status is Status.INVALID
    assert np.abs(block.y_hat).max() <= 1e3 * np.abs(y).max()


@compiled_with_lock
def judge(a: FloatArray, n: int, room: FloatArray) -> bool:
    return is_stable(a, n, room)


@pytest.mark.parametrize("na", [1, 2, 3, 4, 7])
def test_stability_is_judged_as_by_the_roots(na: int) -> None:
    rng = np.random.default_rng(na)
    verdicts = set()
    for _ in range(300):
        half = rng.uniform(0.7, 1.1) * np.exp(1j * rng.uniform(0, np.pi, na // 2))
        roots = np.concatenate([half, half.conj(), rng.uniform(-1.05, 1.05, na % 2)])
        polynomial = np.real(np.poly(roots))
        expected = bool(np.abs(np.roots(polynomial)).max() < 1)
        assert bool(judge(polynomial[1:].copy(), na, np.zeros(na))) is expected
        verdicts.add(expected)
    assert verdicts == {True, False}


@pytest.mark.parametrize(
    ("L", "named"),
    [
        ([1.0, -1.0], "root of magnitude 1, expected all inside"),
        ([1.0, -2.5, 1.0], "root of magnitude 2"),
        ([2.0, 0.1], "expected finite coefficients 1, l_1"),
        ([1.0, np.nan], "expected finite coefficients"),
        ([], "expected finite coefficients"),
        ([[1.0, 0.2]], "expected finite coefficients"),
    ],
)
def test_a_filter_that_can_not_filter_is_refused(L: list[float], named: str) -> None:
    with pytest.raises(BadModel, match=named):
        Oefo(np.array(L), ORDERS)
