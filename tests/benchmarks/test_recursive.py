"""The recursive benchmark compares one algorithm with itself and one problem with itself. No time is judged."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from estimator.identification.online.adaptation import DecreasingGain, DecreasingThenConstantTrace
from estimator.identification.online.registry import ESTIMATORS
from estimator.identification.online.rls_riv_oeepm import Rls
from tests.benchmarks import recursive, recursive_c, recursive_padasip
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


def test_more_orders_than_the_c_has_room_for_are_refused() -> None:
    from estimator.identification.linear_model import Orders

    with recursive_c.compiled() as run, pytest.raises(ValueError, match="no room for the orders"):
        run(Orders(20, 20, 1), MODEL.A, DecreasingThenConstantTrace().law, 0, *data(10))


def test_least_squares_has_the_rows_that_padasip_is_given() -> None:
    u, y, okay = data(3000)
    rows = regressors(u, y)
    weighed = np.vstack([rows, np.eye(8) / np.sqrt(1000.0)])  # F(0) = 1000 I on both sides
    batch = np.linalg.lstsq(weighed, np.concatenate([y, np.zeros(8)]), rcond=None)[0]
    estimator = Rls(MODEL.orders, DecreasingGain())
    estimator.run(u, y, okay)
    np.testing.assert_allclose(estimator.theta, batch, rtol=1e-6)


@pytest.mark.campaign  # each is compiled for this
def test_every_estimator_is_timed() -> None:
    lines = recursive.single(pairs=1, n=recursive.BLOCK)
    assert [line[0] for line in lines] == list(ESTIMATORS)
    assert all(cell.endswith(" us") and float(cell.split()[0]) > 0 for line in lines for cell in line[1:])


def test_a_stream_ten_times_as_long_takes_no_more_memory() -> None:
    short, long = (float(peak.split()[0]) for _, peak in recursive.memory((3, 30)))
    assert long < 1.2 * short


def test_where_there_is_no_padasip_it_says_how_to_get_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recursive, "python_with_padasip", lambda given: given)
    assert recursive.padasip(1, None) == []
    assert "pip install padasip==1.2.2" in capsys.readouterr().err


def test_padasips_side_says_what_is_missing(tmp_path: Path) -> None:
    """Its script is its own program: it fails in its own words where padasip is absent, or answers in JSON."""
    python = recursive.python_with_padasip(None)
    np.savez(tmp_path / "data.npz", x=np.eye(3), y=np.ones(3))
    command: list[str] = [python or sys.executable, str(recursive_padasip.__file__), str(tmp_path / "data.npz")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "padasip" in done.stderr if python is None else done.returncode == 0
