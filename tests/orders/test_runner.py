"""What a run is predicted to be, and between what its speed is kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil.errors import RunAborted
from hil.orders.order import Order, as_table
from hil.orders.runner import Band, Runner, SpeedBandLeft, WithinBand, margin_rad_s, predict
from hil.simulator.driveline import DEFAULT_BUS
from tests.design.test_candidates import SOURCE

RAMPS = {"kind": "ramp", "swing_nm": 200.0, "ramp_s": 4.0, "duration_s": 10.0, "prbs": False}
ORDER = Order("ramps", {**RAMPS, "torque_nm": 500.0, "slew_nm_per_s": 1000.0})
NOT_USED: Any = None


def test_a_load_that_the_model_gives_is_held_on_paper() -> None:
    rig, _ = SOURCE.ordered(ORDER)
    free, loaded = (predict(rig, "ramps", replace(DEFAULT_BUS, load=load)) for load in (0.0, 50.0))
    assert np.mean(loaded.torque_nm) - np.mean(free.torque_nm) == pytest.approx(50.0, rel=0.1)


def test_the_band_holds_for_each_line_that_the_vehicle_may_be(tmp_path: Path) -> None:
    runner, lines = Runner(SOURCE, tmp_path, NOT_USED), [replace(DEFAULT_BUS, load=load) for load in (0.0, 50.0, -50.0)]
    predictions = runner.predictions(ORDER, lines, 0.0)
    band = Band.around(predictions, 1.0)
    low, high = (
        pick(getattr(each.speed_rad_s, end) for each in predictions) for pick, end in ((min, "low"), (max, "high"))
    )
    assert low < predictions[0].speed_rad_s.low < predictions[0].speed_rad_s.high < high
    margin = margin_rad_s(low, high, 1.0)
    assert band == Band(low - margin, high + margin, margin)


def test_a_line_with_which_the_run_would_end_early_needs_no_band(tmp_path: Path) -> None:
    """A cruise that the vehicle would never get to: its own end is what ends it."""
    runner, cruise = Runner(SOURCE, tmp_path, NOT_USED), SOURCE.rig().experiments["cruise"]
    order, stuck = Order("cruise", as_table(cruise)), replace(DEFAULT_BUS, load=5000.0)
    assert len(runner.predictions(order, [stuck, DEFAULT_BUS], 0.0)) == 1
    with pytest.raises(RunAborted):
        runner.predictions(order, [stuck], 0.0)


def test_a_speed_beyond_the_band_ends_the_run() -> None:
    experiment: Any = type("Still", (), {"duration_s": 1.0, "torque": staticmethod(lambda *_: "torque")})()
    banded = WithinBand(experiment, -1.0, 1.0, 1.0, 0.01)
    assert banded.torque(0.0, 0.0) == "torque"
    steps = (banded.torque(0.01 * i, 2.0) for i in range(1, 100))
    with pytest.raises(SpeedBandLeft, match=r"expected -1\.0 to 1\.0 rad/s"):
        list(steps)
