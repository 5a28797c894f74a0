"""A planted tone stands in its band of the error's spectrum, and noise in none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.where.locate import error_spectrum
from estimator.physics.fit import fit
from estimator.physics.problem import make_problem
from tests.estimator.diagnosis.planted import SIGMA, nominal_fit, quiet
from tests.estimator.physics.bench import TWO_MASS, model


def test_a_tone_stands_in_its_band_alone() -> None:
    records = quiet((1, 2, 3))
    tone = [replace(r, output=r.output + 0.05 * np.sin(2 * np.pi * 8.0 * r.time_s)) for r in records]
    result = fit(make_problem(model(TWO_MASS), tone, ()))
    spectrum = error_spectrum(result, result, SIGMA)
    loud = [(b.low_hz, b.high_hz) for b in spectrum.bands if b.p_value < 0.01]
    assert len(loud) == 1
    assert loud[0][0] <= 8.0 < loud[0][1]
    assert spectrum.frequency_hz[np.argmax(spectrum.before)] == pytest.approx(8.0, abs=0.4)
    assert np.median(spectrum.before) == pytest.approx(spectrum.floor, rel=0.15)


def test_bands_share_the_frequencies_out() -> None:
    result = nominal_fit(quiet((1,)))
    spectrum = error_spectrum(result, result, SIGMA)
    edges = [(b.low_hz, b.high_hz) for b in spectrum.bands]
    assert [low for low, _ in edges[1:]] == [high for _, high in edges[:-1]]
    assert edges[0][0] <= spectrum.frequency_hz[0]
    assert edges[-1][1] >= spectrum.frequency_hz[-1]


@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_stands_in_no_band(seed: int) -> None:
    result = fit(make_problem(model(TWO_MASS), quiet((seed + 10, seed + 20)), ()))
    assert min(b.p_value for b in error_spectrum(result, result, SIGMA).bands) > 0.001
