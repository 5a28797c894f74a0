"""Panels: what they say, and that they never say more than there is room for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.plc.types import ClutchState, DriveMode, PlcStatus, PlcWatchdog, PrbsSettings, PrbsSource
from estimator.identification.tracking.alarm import Alarm, Level
from hil.monitor import bus_panels, head_panels, model_panels, signal_panels
from hil.monitor.messages import Began, Kind, NodeHealth, Notice, PlcHealth, Ready, Samples
from hil.monitor.panel import Draw
from hil.monitor.snapshot import Activity, History, Model, Snapshot
from hil.monitor.state import LiveState
from hil.rig.experiments.base import Phase
from tests.monitor.fake_source import PERIOD_S, health, node, sample

DRAWN: tuple[Draw, ...] = (
    signal_panels.torque,
    signal_panels.speed,
    signal_panels.prbs,
    signal_panels.twist,
    model_panels.response,
    model_panels.poles,
    model_panels.resonance,
    model_panels.damping,
    model_panels.figures,
    model_panels.alarms,
    bus_panels.brief,
    bus_panels.full,
    head_panels.headline,
    head_panels.message,
    head_panels.log,
)

STATUS = PlcStatus(
    drive_mode=DriveMode.SERIES,
    clutch=ClutchState.OPEN,
    permissive=True,
    speed_limit_rad_s=300.0,
    torque_limit_nm=400.0,
    watchdog=PlcWatchdog(5, 4),
    prbs=PrbsSettings(False, 0.0, 1, 1, PrbsSource.HOST),
    prbs_torque_nm=0.0,
    t_ns=0,
)

ALARM = Alarm(
    time_s=63.2,
    changed_between_s=(55.0, 60.0),
    quantity="resonance_hz",
    before=Level(8.21, (8.2, 8.22)),
    after=Level(7.6, (7.5, 7.7)),
    settled=True,
    statistic=31.0,
    threshold=12.0,
    false_alarms_per_hour=0.01,
)


def snapshot(m1: NodeHealth | None = None, plc: PlcHealth | None = None) -> Snapshot:
    """A run under way, with a model whose resonance is at 8 Hz and an alarm."""
    live = LiveState("a bus with a long name that does not fit", PERIOD_S, None, can_drive=True)
    live.take(Ready())
    live.take(Began("cruise", "runs/cruise.parquet", 30.0))
    live.take(Samples(tuple((sample(k, 20.0 * (-1) ** k, 0.1 * k, 120.0), Phase.MEASURE) for k in range(700))))
    live.take(Notice(0, Kind.MARK, "a very long note " * 20))
    live.take(health(m1, plc or PlcHealth(STATUS, 0.05, None)))
    shown = live.snapshot()
    pole = 0.93 * np.exp(2j * math.pi * 8.0 * 0.02)
    poles = np.array([pole, pole.conjugate(), 0.5, -0.4], dtype=np.complex128)
    hertz = np.geomspace(0.5, 25.0, 100)
    model = Model(hertz, 1.0 / (0.1 + np.abs(hertz - 8.0)), poles, np.array([1.2 + 0j]), poles[:1] * 0.99, 0.02)
    points = np.linspace(-100.0, 0.0, 50)
    history = History(points, 8.0 + 0.01 * points, np.full(50, 0.1), np.full(50, 0.05), np.full(50, math.nan))
    estimation = replace(
        shown.estimation,
        status="estimated",
        resonance_hz=8.0,
        resonance_std_hz=0.05,
        damping=0.05,
        history=history,
        model=model,
        alarms=(ALARM,),
    )
    return replace(shown, estimation=estimation)


@pytest.mark.parametrize("draw", DRAWN)
def test_a_panel_fits_every_size(draw: Draw) -> None:
    shown = snapshot(node(emergency="EMCY 0x8130 life guard or heartbeat error " * 3))
    for width, height in ((80, 22), (31, 5), (20, 3), (9, 2), (160, 50)):
        lines = draw(shown, width, height)
        assert len(lines) <= max(height, 2)
        assert all(len(line) <= width for line in lines), (width, height, lines)


@pytest.mark.parametrize("draw", DRAWN)
def test_a_panel_draws_when_nothing_is_known_yet(draw: Draw) -> None:
    empty = LiveState("bus", PERIOD_S, None, can_drive=False).snapshot()
    assert all(len(line) <= 40 for line in draw(empty, 40, 8))


def test_the_peak_of_the_response_stands_over_its_frequency() -> None:
    lines = model_panels.response(snapshot(), 60, 12)
    peak = next(line for line in lines[1:] if any(ord(letter) > 0x2800 for letter in line))
    at = next(column for column, letter in enumerate(peak) if ord(letter) > 0x2800)
    ticks = lines[-1]
    assert ticks.index("5") < at < ticks.index("10")


def test_poles_and_zeros_are_letters_in_the_plane() -> None:
    text = "\n".join(model_panels.poles(snapshot(), 72, 19)[1:])
    assert text.count("x") == 3  # the pair shows once: it is the upper half
    assert text.count("o") == 1


def test_an_alarm_says_what_changed_and_on_what_evidence() -> None:
    text = " ".join(" ".join(model_panels.alarms(snapshot(), 80, 6)).split())
    assert f"ALARM {ALARM.statement}, evidence 31 above 12" in text
    assert "alarms    1, last: resonance_hz 8.21 -> 7.6" in model_panels.figures(snapshot(), 60, 5)


@pytest.mark.parametrize(
    ("m1", "plc", "words"),
    [
        (node(tpdo_age_s=3.2), None, "STALE: TPDO 3.2 s old"),
        (node(tpdo_age_s=None), None, "STALE: TPDO never came"),
        (node(heartbeat_age_s=0.9), None, "HEARTBEAT LOST: last 0.9 s ago"),
        (node(heartbeat_age_s=None), None, "HEARTBEAT LOST: last never came"),
        (node(emergency="EMCY 0x3220 DC link"), None, "EMCY 0x3220 DC link"),
        (node(trouble="no answer to SDO"), None, "no answer to SDO"),
        (None, PlcHealth(STATUS, 4.0, None), "STALE: silent for 4.0 s"),
        (None, PlcHealth(None, None, "PLC 127.0.0.1: gone"), "PLC 127.0.0.1: gone"),
    ],
)
def test_what_is_wrong_is_said_in_words(m1: NodeHealth | None, plc: PlcHealth | None, words: str) -> None:
    shown = snapshot(m1, plc)
    for draw in (bus_panels.brief, bus_panels.full):
        text = "\n".join(draw(shown, 120, 30))
        assert words in text
        assert "TROUBLE" in text


def test_a_healthy_bus_is_called_so() -> None:
    for draw in (bus_panels.brief, bus_panels.full):
        lines = draw(snapshot(), 80, 30)
        assert lines[0].endswith("OK")
        assert not any("STALE" in line for line in lines)


def test_of_a_bus_that_is_lost_nothing_old_is_shown() -> None:
    healthy = snapshot()
    lost = replace(healthy, headline=replace(healthy.headline, activity=Activity.LOST))
    for draw in (bus_panels.brief, bus_panels.full):
        text = "\n".join(draw(lost, 80, 30))
        assert "LOST" in text
        assert "OK" not in text
        assert "operation enabled" not in text


def test_a_permit_that_is_withdrawn_is_said_so() -> None:
    plc = PlcHealth(replace(STATUS, permissive=False, clutch=ClutchState.CLOSED), 0.05, None)
    assert "plc series clutch closed NO PERMIT" in bus_panels.brief(snapshot(plc=plc), 40, 9)
    assert "permissive WITHDRAWN" in "\n".join(bus_panels.full(snapshot(plc=plc), 80, 30))


def test_the_headline_says_what_is_driven() -> None:
    assert head_panels.headline(snapshot(), 80, 1)[0].startswith("RUNNING cruise measure 7.0 s of 30 s")
