"""What the view knows after what it was sent."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimator.physics.joint import Shaft
from hil.monitor.messages import Began, Ended, Kind, Lost, Notice, Over, Ready, Samples, outcome
from hil.monitor.snapshot import Activity
from hil.monitor.state import WINDOWS_S, LiveState
from hil.rig.experiments.base import Phase
from hil.sample import SampleFlag
from hil.simulator.driveline import DEFAULT_BUS
from tests.monitor.fake_source import PERIOD_S, sample

DONE = Over("cruise", "runs/cruise.parquet", 3000, 2, stopped=False, reason=None, run_id=7)


def state(can_drive: bool = True) -> LiveState:
    return LiveState("bus", PERIOD_S, Shaft.of_model(DEFAULT_BUS, "model"), can_drive)


def test_a_run_from_order_to_end() -> None:
    live = state()
    live.take(Ready())
    assert live.activity is Activity.LISTENING
    live.starting("cruise")
    assert live.is_driving
    live.take(Began("cruise", "runs/cruise.parquet", 30.0))
    live.take(Samples(((sample(150, 20.0, 3.0), Phase.MEASURE),)))
    head = live.snapshot().headline
    assert (head.activity, head.phase, head.phase_s, head.duration_s) == (Activity.RUNNING, "measure", 1.5, 30.0)
    live.stopping("stop")
    assert live.activity is Activity.STOPPING
    live.take(DONE)
    assert live.activity is Activity.LISTENING
    assert live.runs == [DONE]
    assert "3000 samples, 2 flagged, run 7, runs/cruise.parquet" in live.snapshot().headline.message


def test_a_run_that_failed_says_why() -> None:
    failed = Over("cruise", None, 0, 0, stopped=False, reason="inverter m2: no TPDO")
    assert outcome(failed) == "cruise ENDED EARLY: inverter m2: no TPDO (nothing recorded)"
    live = state()
    live.take(failed)
    assert live.snapshot().log[-1].kind is Kind.FAULT


def test_channels_are_those_of_the_samples_with_their_names_and_units() -> None:
    units = {"speed_load_rad_s": "rad/s", "torque_shaft_nm": "Nm"}
    live = LiveState("bus", PERIOD_S, None, can_drive=True, channel_units=units)
    read = [(1.0, 5.0), (2.0, math.nan)]
    live.take(Samples(tuple((replace(sample(k), channels=read[k]), None) for k in range(2))))
    first, second = live.snapshot().signals.channels
    assert [(each.name, each.unit) for each in (first, second)] == list(units.items())
    np.testing.assert_array_equal(first.values, [1.0, 2.0])
    np.testing.assert_array_equal(second.values, [5.0, math.nan])


def test_a_flagged_sample_is_a_gap_and_not_a_value() -> None:
    live = state()
    rows = ((sample(0, 10.0, 1.0), None), (sample(1, 999.0, 9.0, flags=SampleFlag.M1_STALE), None))
    live.take(Samples(rows))
    signals = live.snapshot().signals
    np.testing.assert_array_equal(signals.torque_nm, [10.0, math.nan])
    np.testing.assert_array_equal(signals.speed_rad_s, [1.0, math.nan])
    np.testing.assert_allclose(signals.time_s, [-PERIOD_S, 0.0], atol=1e-12)


def test_the_window_holds_what_it_says_at_every_zoom() -> None:
    live = state()
    live.take(Samples(tuple((sample(k), None) for k in range(8000))))
    live.zoom(-len(WINDOWS_S))
    spans = []
    for window_s in WINDOWS_S:
        signals = live.snapshot().signals
        assert signals.window_s == window_s
        spans.append(-signals.time_s[0])
        live.zoom(1)
    np.testing.assert_allclose(spans, WINDOWS_S, atol=1.01 * PERIOD_S)


def test_a_lost_bus_is_reported_once_and_its_return_too() -> None:
    live = state()
    for report in (Ready(), Lost("no bus"), Lost("no bus"), Ready()):
        live.take(report)
    assert [notice.text for notice in live.snapshot().log] == ["no bus", "the bus is there again"]
    assert live.activity is Activity.LISTENING


def test_the_end_stays_known() -> None:
    live = state()
    live.take(Ended("gone"))
    assert live.activity is Activity.ENDED
    assert live.ended == Ended("gone")
    assert live.snapshot().headline.message == "gone"


def test_samples_that_were_not_sent_are_reported() -> None:
    live = state()
    live.take(Samples(((sample(0), None),), lost=12))
    assert "12 samples not shown" in live.snapshot().log[-1].text


@pytest.mark.parametrize("kind", [kind for kind in Kind if kind is not Kind.INFO])
def test_what_matters_stands_in_the_message_with_its_kind(kind: Kind) -> None:
    live = state()
    live.take(Notice(0, kind, "text"))
    assert live.snapshot().headline.message == f"{kind.value}: text"


def test_a_recording_is_played_and_not_driven() -> None:
    live = state(can_drive=False)
    live.take(Began("", "cruise.csv", 30.0))
    live.take(Samples(((sample(100), Phase.MEASURE),)))
    head = live.snapshot().headline
    assert (head.activity, head.phase_s) == (Activity.REPLAYING, 1.0)
    assert not live.is_driving
    live.take(Over("", "cruise.csv", 3000, 0, stopped=False, reason=None))
    assert live.activity is Activity.PLAYED
