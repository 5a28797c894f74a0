import numpy as np
import pytest

from estimator.errors import BadSetting
from estimator.signals.prbs import TAPS, Prbs, prbs_nm, shift


@pytest.mark.parametrize("cells", sorted(TAPS))
def test_every_register_runs_through_all_its_non_zero_states(cells: int) -> None:
    state, seen = 1, 0
    while not seen or state != 1:
        state = shift(state, cells)
        seen += 1
        assert 0 < state < 2**cells
    assert seen == 2**cells - 1


def test_autocorrelation_has_two_values() -> None:
    levels = prbs_nm(1023, amplitude_nm=3.0)
    correlation = np.array([np.dot(levels, np.roll(levels, lag)) for lag in range(1023)]) / 1023
    assert correlation[0] == pytest.approx(9.0)
    np.testing.assert_allclose(correlation[1:], -9.0 / 1023, rtol=1e-9)


def test_step_by_step_equals_the_array() -> None:
    source = Prbs(2.5, cells=7, clock_divider=2, seed=9)
    assert [source.next() for _ in range(400)] == prbs_nm(400, 2.5, 7, 2, 9).tolist()


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"seed": 0}, "seed is 0, expected a state from 1 to 1023"),
        ({"seed": 1024}, "seed is 1024"),
        ({"seed": -1}, "seed is -1"),
        ({"cells": 1}, "cells is 1, expected a register length from 2 to 16"),
        ({"cells": 17}, "cells is 17"),
        ({"clock_divider": 0}, "clock_divider is 0, expected 1 or more"),
        ({"amplitude_nm": 0.0}, "amplitude_nm is 0.0, expected a torque above 0 Nm"),
        ({"amplitude_nm": float("nan")}, "amplitude_nm is nan"),
        ({"amplitude_nm": float("inf")}, "amplitude_nm is inf"),
    ],
)
def test_settings_that_make_no_sequence_are_refused(settings: dict[str, float], named: str) -> None:
    with pytest.raises(BadSetting, match=named):
        Prbs(**({"amplitude_nm": 1.0} | settings))  # type: ignore[arg-type]
