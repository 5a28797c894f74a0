"""The numbers of the figures, and the band they are taken in."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.identification.identify import identify
from hil.figures.local_model import LocalModel, Reference, TwoMassLine, row_of
from tests.estimator.identification.driveline import B_L, B_M, J_L, J_M, C, K, cruise, true_resonance

LINE = TwoMassLine(J_M, J_L, K, C, B_M, B_L)


@pytest.fixture(scope="module")
def model() -> LocalModel:
    record = cruise(3).record
    return LocalModel(record, identify(record), Reference("truth", LINE))


def test_a_row_holds_errors_to_the_reference(model: LocalModel) -> None:
    row = row_of(model)
    frequency_hz, damping = true_resonance()
    assert (row.reference_hz, row.reference_damping) == pytest.approx((frequency_hz, damping))
    assert row.error("hz", "online") == pytest.approx(row.online_hz / frequency_hz - 1.0)
    assert abs(row.error("hz", "online")) < 0.02
    assert abs(row.error("damping", "offline")) < 0.15
    assert row.status == "estimated"
    assert 0.0 <= row.offline_db < math.inf


def test_the_band_is_one_stretch_around_the_resonance(model: LocalModel) -> None:
    f = model.coherent_hz
    spectral = model.found.spectral
    assert spectral is not None
    assert f.min() < true_resonance()[0] < f.max()
    inside = np.isin(spectral.frequency_hz, f)
    assert (np.diff(np.flatnonzero(inside)) == 1).all()
    assert (spectral.coherence[inside] > 0.9).all()
    first, last = np.flatnonzero(inside)[[0, -1]]
    assert first == 0 or spectral.coherence[first - 1] <= 0.9
    assert last == inside.size - 1 or spectral.coherence[last + 1] <= 0.9


def test_without_resonance_spectrum_or_reference_there_are_no_such_numbers(model: LocalModel) -> None:
    bare = replace(model.found, spectral=None, online_resonance=None, batch_resonance=None)
    row = row_of(LocalModel(model.record, bare))
    for value in (row.online_hz, row.offline_damping, row.reference_hz, row.spectral_db, row.error("hz", "online")):
        assert math.isnan(value)


def test_the_third_order_equivalent_keeps_the_resonance(model: LocalModel) -> None:
    low = model.third_order
    assert low is not None
    assert len(low.a) == 3
    found = model.found.online_resonance
    assert found is not None
    z = max(low.poles, key=lambda pole: pole.imag)
    assert abs(np.log(z)) / (2 * np.pi * low.sample_time_s) == pytest.approx(found.frequency_hz, rel=0.02)
