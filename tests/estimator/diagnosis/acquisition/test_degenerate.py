"""No recogniser fails on data in which nothing varies, or next to nothing: it finds something or it does not."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from estimator.diagnosis.acquisition.chain import compensate, recognise
from estimator.diagnosis.acquisition.jitter import hidden_jitter, stamped_jitter
from estimator.diagnosis.acquisition.quantised import lost_samples, speed_quantisation
from estimator.diagnosis.acquisition.stale import stale_samples
from estimator.signals.record import FloatArray, Record
from tests.chosen import one_in

Make = Callable[[int], FloatArray]

SHAPES: dict[str, Make] = {
    "zero": np.zeros,
    "constant": lambda n: np.full(n, 5.0),
    "ramp": lambda n: np.arange(n, dtype=float),
    "alternating": lambda n: np.arange(n) % 2.0,
    "one step": lambda n: (np.arange(n) > n // 2).astype(float),
    "one spike": lambda n: (np.arange(n) == n // 2).astype(float),
    "two values apart": lambda n: np.where(np.arange(n) < n // 2, -3.0, 3.0),
    "huge": lambda n: 1e12 * np.sin(0.1 * np.arange(n)),
    "tiny": lambda n: 1e-12 * np.sin(0.1 * np.arange(n)),
    "missing": lambda n: np.where(np.arange(n) % 3 == 0, np.nan, 1.0),
    "all missing": lambda n: np.full(n, np.nan),
}
SIZES = (2, 3, 12, 400)


def record(time_s: FloatArray, torque: FloatArray, output: FloatArray) -> Record:
    return Record("run", 0.01, time_s, torque[:, np.newaxis], output, np.isfinite(output))


@pytest.mark.parametrize(("torque", "output"), one_in(3, itertools.product(SHAPES, repeat=2)))
def test_every_recogniser_bears_readings_that_hardly_vary(torque: str, output: str) -> None:
    for n in SIZES:
        driven = np.nan_to_num(SHAPES[torque](n))
        made = record(0.01 * np.arange(n), driven, SHAPES[output](n))
        with np.errstate(divide="raise", invalid="raise"):
            for look in (lost_samples, stale_samples, speed_quantisation, stamped_jitter):
                look([made])
            compensate([made], recognise([made]))


@pytest.mark.parametrize(("error", "slope"), list(itertools.product(SHAPES, repeat=2)))
def test_hidden_jitter_bears_errors_and_slopes_that_hardly_vary(error: str, slope: str) -> None:
    for n in SIZES:
        errors, slopes = SHAPES[error](n), np.tile(np.nan_to_num(SHAPES[slope](n)), (2, 1))
        made = record(0.01 * np.arange(n), np.zeros(n), errors)
        with np.errstate(divide="raise", invalid="raise"):
            hidden_jitter([made], [np.nan_to_num(errors)], [slopes], [made.okay])
