"""Order analysis of planted waves."""

from __future__ import annotations

import numpy as np
import pytest

from estimator.diagnosis.unnamed.forms import peaks


def test_orders_of_waves_are_found_strongest_first() -> None:
    time_s = np.arange(0.0, 30.0, 0.01)
    angle = 20.0 * time_s + 0.6 * time_s**2
    wave = 3.0 * np.cos(3.0 * angle + 1.0) + 0.5 * np.sin(0.4 * angle)
    found = peaks([wave, wave[::-1]], [angle, angle[::-1]])
    assert found[0] == pytest.approx(3.0, abs=0.01)
    assert np.min(np.abs(found - 0.4)) < 0.01


def test_what_does_not_turn_has_no_orders() -> None:
    assert peaks([np.ones(100)], [np.zeros(100)]).size == 0
