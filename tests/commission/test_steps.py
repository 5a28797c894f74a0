"""What the steps find on rigs with a planted fault."""

from pathlib import Path

import pytest

from hil.commission.state import Status, model_json
from hil.commission.steps import prbs
from hil.errors import RunAborted
from hil.simulator.driveline import DEFAULT_BUS
from tests.commission.rigs import bench
from tests.rig.observer import assert_disarmed


def test_sound_rig_passes_the_first_steps(tmp_path: Path) -> None:
    with bench(tmp_path) as rig:
        state = rig.call("limits", "noise", "signs")
        assert_disarmed(rig.server.bus_url, 1, 2)
    assert all(finding.within is not False for finding in rig.shown)
    assert state.steps["signs"].status is Status.DONE
    assert rig.finding("m1: sign").measured == rig.finding("m2: sign").measured == "forward"


@pytest.mark.campaign
def test_wrong_sign_of_one_inverter_blocks(tmp_path: Path) -> None:
    with bench(tmp_path, miswired=True) as rig:
        with pytest.raises(RunAborted, match=r"m2: sign.*got backward.*Swap two phases of m2"):
            rig.call("signs")
        assert_disarmed(rig.server.bus_url, 1, 2)
        assert rig.job().state.steps["signs"].status is Status.BLOCKED
    assert rig.finding("m1: sign").within is True
    assert rig.finding("m2: sign").within is False


@pytest.mark.campaign
def test_vehicle_held_by_friction_gets_more_torque_and_then_an_answer(tmp_path: Path) -> None:
    with bench(tmp_path, effects=["coulomb_friction_motor:friction_nm=30"]) as rig:
        rig.call("signs")
    assert any("nothing seen to move with" in line for line in rig.said)
    assert rig.finding("m1: sign").measured == "forward"


def test_noise_is_measured(tmp_path: Path) -> None:
    with bench(tmp_path, changes=[("speed_noise_rad_s = 0.05", "speed_noise_rad_s = 0.4")]) as rig:
        state = rig.call("noise")
    measured = state.steps["noise"].evidence["speed_std_rad_s"]
    assert measured == pytest.approx(0.4, rel=0.1)  # 1000 samples: 2.2 % standard deviation
    assert rig.finding("speed noise (RMS)").within is False


def test_friction_and_inertia_are_measured(tmp_path: Path) -> None:
    with bench(
        tmp_path,
        effects=["coulomb_friction_load:friction_nm=60"],
        changes=[("inertia_kg_m2 = 100.0", "inertia_kg_m2 = 140.0")],
    ) as rig:
        state = rig.call("friction")
    evidence = state.steps["friction"].evidence
    inertia, spread = evidence["inertia_kg_m2"]
    assert abs(inertia - 101.6) < max(2.0 * spread, 2.0)  # the elastic line is fitted as a rigid one: 2 %
    dry, spread = evidence["dry_nm"]
    assert abs(dry - 60.0) < max(2.0 * spread, 6.0)
    assert "Set [vehicle] inertia_kg_m2 = 10" in rig.finding("total inertia at the motor shaft").advice


SHORT = (("duration_s = 30.0", "duration_s = 12.0"), ("speed_rad_s = 60.0", "speed_rad_s = 20.0"))

SCALES = {
    "resonance": [8.22, 0.057],
    "spread": [1e-4, 2e-3],
    "amplitude_nm": 60.0,
    "duration_s": 20.0,
    "model": model_json(DEFAULT_BUS),
}
"""What the scales step leaves of the sound rig."""


@pytest.mark.campaign
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
        assert "(as in the rig file)" in prbs.PRBS.about(job)
        job.travel_m_per_rad = 0.5  # a vehicle that goes six times as far per turn: six times the vibration
        assert "(held down by the comfort of those on board)" in prbs.PRBS.about(job)
        (order, _) = prbs.PRBS.orders(job)
    assert 0.0 < order.prbs["amplitude_nm"] < 120.0
