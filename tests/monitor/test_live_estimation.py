"""The on-line chain behind the view: the same figures as the chain by itself, in whatever portions samples come."""

import numpy as np
import pytest

from estimator.identification.tracking.alarm import TrackingState
from estimator.physics.joint import Shaft
from hil.monitor.live_estimation import LiveEstimation
from hil.rig.live import LiveEstimate, OnlineSetup, tracking_chain, tracking_settings
from hil.sample import Sample, SampleFlag
from hil.simulator.driveline import DEFAULT_BUS
from tests.estimator.identification.tracking.drives import drives
from tests.monitor.fake_source import sample
from tests.monitor.two_mass import PERIOD_S, driven

CYCLES = 2500
RESONANCE_HZ, DAMPING = 8.22, 0.057
"""Of the default bus (hil.simulator.driveline)."""


@pytest.fixture(scope="module")
def rows() -> list[Sample]:
    """Samples of the default bus under a PRBS, with the bus's own noise."""
    shaft = Shaft.of_model(DEFAULT_BUS, "test")
    assert shaft is not None
    drive = driven(shaft, CYCLES, seed=1, speed_std_rad_s=0.05)
    pairs = zip(drive.torque_nm.tolist(), drive.speed_rad_s.tolist(), strict=True)
    return [sample(k, torque, speed) for k, (torque, speed) in enumerate(pairs)]


def fed(rows: list[Sample], portion: int) -> LiveEstimation:
    live = LiveEstimation(PERIOD_S)
    live.begin()
    for at in range(0, len(rows), portion):
        live.take(rows[at : at + portion])
    return live


def test_portions_do_not_matter_and_a_run_says_the_same(rows: list[Sample]) -> None:
    alone = LiveEstimate(tracking_chain(PERIOD_S))
    for row in rows:
        alone(row)
    assert alone.latest is not None
    for portion in (7, 100, CYCLES):
        seen = fed(rows, portion).look(rows[-1].t_ns)
        assert alone.latest.resonance is not None
        assert seen.resonance_hz == alone.latest.resonance.frequency_hz
        assert seen.resonance_std_hz == alone.latest.frequency_std_hz
        assert seen.damping == alone.latest.resonance.damping


def test_the_resonance_is_that_of_the_line(rows: list[Sample]) -> None:
    seen = fed(rows, 10).look(rows[-1].t_ns)
    assert seen.status == "estimated"
    assert seen.resonance_hz == pytest.approx(RESONANCE_HZ, rel=0.01)
    assert seen.damping == pytest.approx(DAMPING, rel=0.15)
    assert seen.model is not None
    peak_hz = seen.model.frequency_hz[np.argmax(seen.model.gain)]
    assert peak_hz == pytest.approx(RESONANCE_HZ, rel=0.03)
    assert seen.history.time_s[-1] <= 0.0
    assert len(seen.model.trail) >= 4


def test_the_response_without_a_model_goes_through_the_same_peak(rows: list[Sample]) -> None:
    """Also where cycles were left out: their place in time is kept."""
    for shown in (rows, [row for row in rows if row.cycle % 500 > 1]):
        model = fed(shown, 10).look(rows[-1].t_ns).model
        assert model is not None
        near = (model.measured_hz > 5.0) & (model.measured_hz < 12.0)
        assert near.sum() > 10
        gain = np.interp(model.measured_hz[near], model.frequency_hz, model.gain)
        assert np.abs(20.0 * np.log10(model.measured_gain[near] / gain)).max() < 4.0


def test_what_a_flagged_sample_says_does_not_matter(rows: list[Sample]) -> None:
    def lost(torque_nm: float, speed_rad_s: float) -> float:
        stale = SampleFlag.M1_STALE
        changed = [sample(r.cycle, torque_nm, speed_rad_s, flags=stale) if r.cycle % 200 == 7 else r for r in rows]
        return fed(changed, 10).look(0).resonance_hz

    assert lost(9e3, 9e3) == lost(0.0, -1.0) == pytest.approx(RESONANCE_HZ, rel=0.02)


def test_samples_wait_until_the_chain_is_compiled(rows: list[Sample]) -> None:
    ready = False
    live = LiveEstimation(PERIOD_S, is_ready=lambda: ready)
    live.begin()
    live.take(rows[:1000])
    assert "being compiled" in live.look(0).status
    ready = True
    live.take(rows[1000:])
    assert live.look(0).resonance_hz == fed(rows, 10).look(0).resonance_hz


def test_the_history_outlives_a_run_and_the_trail_does_not(rows: list[Sample]) -> None:
    live = fed(rows, 10)
    points = len(live.look(0).history.time_s)
    live.end()
    live.begin()
    seen = live.look(0)
    assert len(seen.history.time_s) == points > 10
    assert seen.model is None
    assert seen.status == "waits for samples"


def test_without_excitation_the_estimate_is_held_and_says_so() -> None:
    record = drives(5, 1, 60.0, prbs_nm=lambda time_s: 120.0 if time_s < 40.0 else 0.0)[0]
    pairs = zip(record.total_torque_nm.tolist(), record.output.tolist(), strict=True)
    rows = [sample(k, torque, speed) for k, (torque, speed) in enumerate(pairs)]
    excited, live = fed(rows[:3900], 100), fed(rows, 100)
    seen, before = live.look(rows[-1].t_ns), excited.look(rows[3899].t_ns)
    assert (before.state, seen.state) == (TrackingState.WATCHING, TrackingState.NOT_EXCITED)
    assert before.status == "estimated"
    assert seen.status.startswith("not excited: ")
    assert "PRBS" in seen.status
    assert seen.resonance_hz == pytest.approx(before.resonance_hz, rel=0.005)
    assert seen.resonance_std_hz > 1.5 * before.resonance_std_hz
    assert seen.model is not None


def test_the_filter_of_an_earlier_run_is_used(rows: list[Sample]) -> None:
    setup = OnlineSetup(tracking_settings(), np.array([1.0, -0.92, 0.88]))
    live, alone = LiveEstimation(PERIOD_S, setup=setup), LiveEstimate(tracking_chain(PERIOD_S, *setup))
    live.begin()
    live.take(rows)
    for row in rows:
        alone(row)
    assert alone.latest is not None
    assert alone.latest.resonance is not None
    assert live.look(0).resonance_hz == alone.latest.resonance.frequency_hz != fed(rows, 100).look(0).resonance_hz
