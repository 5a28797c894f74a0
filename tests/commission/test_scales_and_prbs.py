"""Gain and delay of the inverters, and the amplitude of the PRBS, against what is planted."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil.commission.state import model_json
from hil.commission.steps import prbs
from hil.simulator.plant import DEFAULT_BUS
from tests.commission.rigs import bench

SHORT = (("duration_s = 30.0", "duration_s = 12.0"), ("speed_rad_s = 60.0", "speed_rad_s = 20.0"))

SCALES = {
    "resonance": [8.22, 0.057],
    "spread": [1e-4, 2e-3],
    "amplitude_nm": 60.0,
    "duration_s": 20.0,
    "model": model_json(DEFAULT_BUS),
}
"""What the scales step leaves of the sound rig."""


def test_gain_of_one_inverter_is_measured(tmp_path: Path) -> None:
    true_gain = 0.94
    with bench(tmp_path, effects=[f"inverter_gain_mismatch:gain_m2={true_gain}"]) as rig:
        state = rig.call("scales")
    gain, spread = state.steps["scales"].evidence["gain"]
    assert abs(gain - true_gain) < 2.0 * spread  # two half-widths of a 95 % interval: one chance in ten thousand
    assert spread < 0.015
    finding = rig.finding("m2 against m1: gain, for the same reading")
    assert finding.within is False
    assert finding.measured.endswith("% less")


@pytest.mark.campaign
def test_delay_is_counted_in_samples(tmp_path: Path) -> None:
    with bench(tmp_path, effects=["transport_delay:delay_s=0.02"]) as rig:
        rig.call("scales")
    finding = rig.finding("m1: delay from torque reading to speed")
    assert finding.measured == "3 samples, 2 more (20 ms)"
    assert finding.within is False
    assert rig.finding("m2 against m1: delay").within is True


@pytest.mark.campaign
def test_weak_prbs_is_raised(tmp_path: Path) -> None:
    weak = (*SHORT, ("amplitude_nm = 120.0", "amplitude_nm = 2.0"))
    with bench(tmp_path, changes=weak) as rig:
        state = rig.call("scales", "prbs")
    chosen = state.steps["prbs"].evidence["amplitude_nm"]
    assert chosen > 2.0
    assert rig.finding("standard deviation of its damping, one run").within is True
    assert rig.finding("vibration of the vehicle (RMS)").within is True


def test_prbs_is_held_down_for_those_on_board(tmp_path: Path) -> None:
    with bench(tmp_path, changes=SHORT) as rig:
        job = rig.job()
        job.state.steps["scales"].evidence = SCALES
        assert "(as in the rig file)" in prbs.STEP.about(job)
        job.travel_m_per_rad = 0.5  # a vehicle that goes six times as far per turn: six times the vibration
        assert "(held down by the comfort of those on board)" in prbs.STEP.about(job)
        (order, _) = prbs.STEP.orders(job)
    assert 0.0 < order.prbs["amplitude_nm"] < 120.0
