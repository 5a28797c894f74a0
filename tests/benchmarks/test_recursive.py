"""The recursive benchmark compares one algorithm with itself and one problem with itself. No time is judged."""

import numpy as np

from estimator.identification.online.adaptation import DecreasingGain, DecreasingThenConstantTrace
from estimator.identification.online.estimators import Rls
from tests.benchmarks import recursive, recursive_c
from tests.benchmarks.recursive_data import MODEL, data, regressors


def test_the_c_is_the_same_algorithm() -> None:
    u, y, okay = data(2000)
    okay[300:320] = False
    y[500], u[700] = np.nan, np.nan
    ours = recursive.oefo().run(u, y, okay)
    with recursive_c.compiled() as run:
        out = run(MODEL.orders, MODEL.A, DecreasingThenConstantTrace().law, recursive.START_UP, u, y, okay)
    n = MODEL.orders.n_parameters
    np.testing.assert_allclose(out[:, :n], ours.theta, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(out[:, n], ours.y_hat, rtol=1e-9, atol=1e-12)
    assert np.array_equal(out[:, n + 3] == 1.0, ours.used)
    assert np.array_equal(out[:, n + 4], ours.reason)


def test_least_squares_has_the_rows_that_padasip_is_given() -> None:
    u, y, okay = data(3000)
    rows = regressors(u, y)
    weighed = np.vstack([rows, np.eye(8) / np.sqrt(1000.0)])  # F(0) = 1000 I on both sides
    batch = np.linalg.lstsq(weighed, np.concatenate([y, np.zeros(8)]), rcond=None)[0]
    estimator = Rls(MODEL.orders, DecreasingGain())
    estimator.run(u, y, okay)
    np.testing.assert_allclose(estimator.theta, batch, rtol=1e-6)


def test_a_stream_ten_times_as_long_takes_no_more_memory() -> None:
    short, long = (float(peak.split()[0]) for _, peak in recursive.memory((3, 30)))
    assert long < 1.2 * short
