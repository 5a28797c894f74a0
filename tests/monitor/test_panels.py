"""Panels: what they say, and that they never say more than there is room for."""

import asyncio
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from drivers.plc.types import ClutchState, DriveMode, PlcStatus, PrbsSettings, PrbsSource
from estimator.identification.tracking.alarm import Alarm, Level, TrackingState
from hil.monitor import bus_panels, model_panels, panel as head_panels, panel as log_panel, signal_panels
from hil.monitor.app import MonitorApp
from hil.monitor.messages import Began, LogTopic, NodeHealth, Notice, PlcHealth, Ready, Samples
from hil.monitor.panel import LEAST_WIDTH, Draw, LogPanel, drawn, log, log_lines
from hil.monitor.plot import Canvas, Ring, envelope, nice_range
from hil.monitor.snapshot import History, Model, Snapshot
from hil.monitor.state import LiveState
from hil.rig.experiments.base import Phase
from hil.sample import SampleFlag
from tests.monitor.fake_source import PERIOD_S, FakeSource, health, node, sample, settled

DRAWN: tuple[Draw, ...] = (
    signal_panels.torque,
    signal_panels.speed,
    signal_panels.prbs,
    signal_panels.twist,
    signal_panels.channels,
    model_panels.response,
    model_panels.poles,
    model_panels.resonance,
    model_panels.damping,
    model_panels.figures,
    model_panels.alarms,
    bus_panels.health_summary,
    bus_panels.full,
    head_panels.headline,
    head_panels.message,
    log_panel.log,
    model_panels.standing,
)

STATUS = PlcStatus(
    drive_mode=DriveMode.SERIES,
    clutch=ClutchState.OPEN,
    permissive=True,
    speed_limit_rad_s=300.0,
    torque_limit_nm=400.0,
    plc_count=5,
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
    units = {f"torque_shaft_{k}_nm": "Nm" for k in range(5)}
    live = LiveState("a bus with a long name that does not fit", PERIOD_S, None, can_drive=True, channel_units=units)
    live.take(Ready())
    live.take(Began("cruise", "runs/cruise.parquet", 30.0))
    rows = (sample(k, 20.0 * (-1) ** k, 0.1 * k, 120.0) for k in range(700))
    live.take(
        Samples(tuple((replace(row, channels=(1.5 * row.cycle, *[math.nan] * 4)), Phase.MEASURE) for row in rows))
    )
    live.take(Notice(0, LogTopic.MARK, "a very long note " * 20))
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
def test_a_panel_draws_at_every_size_that_a_terminal_passes_through(draw: Draw) -> None:
    shown = snapshot()
    for width in (*range(LEAST_WIDTH + 30), 80, 200):
        for height in (*range(12), 50):
            lines = drawn(draw, shown, width, height)
            assert len(lines) <= height
            assert all(len(line) <= width for line in lines)
    assert drawn(draw, shown, LEAST_WIDTH, 1)


@pytest.mark.parametrize("draw", DRAWN)
def test_a_panel_draws_when_nothing_is_known_yet(draw: Draw) -> None:
    empty = LiveState("bus", PERIOD_S, None, can_drive=False, channel_units={"accel_rad_s2": "rad/s^2"}).snapshot()
    assert all(len(line) <= 40 for line in draw(empty, 40, 8))


def test_channels_have_their_names_units_and_last_values() -> None:
    lines = signal_panels.channels(snapshot(), 60, 3)
    assert lines[0].split() == ["torque_shaft_0_nm", "[Nm]", "1048.5"]
    assert lines[1].split() == ["torque_shaft_1_nm", "[Nm]", "--"]
    assert lines[2].strip() == "+3 more channels"


def test_the_response_without_a_model_is_marked_over_its_frequency() -> None:
    shown = snapshot()
    model = shown.estimation.model
    assert model is not None
    measured = replace(model, measured_hz=np.array([2.0, 8.0]), measured_gain=np.array([0.2, 5.0]))
    lines = model_panels.response(replace(shown, estimation=replace(shown.estimation, model=measured)), 60, 12)
    marks = [(row, line.index("+")) for row, line in enumerate(lines[1:-1]) if "+" in line]
    assert len(marks) == 2
    assert lines[-1].index(" 5 ") < marks[0][1] < lines[-1].index("10")  # 8 Hz, the higher one
    assert marks[1][1] < lines[-1].index(" 5 ")


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


def test_without_excitation_the_estimate_says_so_in_words() -> None:
    shown = snapshot()
    reason = "not excited: switch the PRBS on"
    estimation = replace(shown.estimation, state=TrackingState.NOT_EXCITED, status=reason, live=True, alarms=())
    shown = replace(shown, estimation=estimation, headline=replace(shown.headline, phase="measure"))
    title, *lines = model_panels.figures(shown, 60, 7)
    assert "NOT EXCITED" in title
    assert any(reason in line for line in lines)
    assert lines[-1] == "alarms    none, not excited"
    watching = replace(shown, estimation=replace(estimation, state=TrackingState.WATCHING, status="estimated"))
    title, *lines = model_panels.figures(watching, 60, 7)
    assert title.endswith("live")
    assert lines[-1] == "alarms    none, watching"


def test_an_alarm_says_what_changed_and_on_what_evidence() -> None:
    text = " ".join(" ".join(model_panels.alarms(snapshot(), 80, 6)).split())
    assert f"ALARM {ALARM.statement}, evidence 31 above 12" in text
    assert "ALARM 1: 8.21 -> 7.6 Hz" in model_panels.figures(snapshot(), 60, 5)


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
    for draw in (bus_panels.health_summary, bus_panels.full):
        text = "\n".join(draw(shown, 120, 30))
        assert words in text
        assert "TROUBLE" in text


def interrupted(n_stale: int) -> Snapshot:
    """A run whose first inverter falls silent for so many cycles."""
    live = LiveState("bus", PERIOD_S, None, can_drive=True)
    live.take(Ready())
    live.take(Began("cruise", "runs/cruise.parquet", 30.0))
    flags = [SampleFlag.GOOD] * 500 + [SampleFlag.M1_STALE] * n_stale
    live.take(Samples(tuple((sample(k, 20.0, 0.1, 120.0, flag), Phase.MEASURE) for k, flag in enumerate(flags))))
    live.take(health())
    return live.snapshot()


@pytest.mark.parametrize(("silent_s", "reported"), [(0.5, False), (3.2, True)])
def test_a_source_that_says_nothing_is_reported(silent_s: float, reported: bool) -> None:
    live = LiveState("bus", PERIOD_S, None, can_drive=True)
    live.take(Ready())
    live.take(health())
    shown = live.snapshot(silent_s)
    assert ("NO NEWS for 3 s" in head_panels.headline(shown, 80, 1)[0]) == reported
    assert bus_panels.full(shown, 80, 22)[0].endswith("NO NEWS 3 s" if reported else "OK")


@pytest.mark.parametrize(
    ("x", "y", "shown"),
    [(0, 0, "⠁"), (1, 0, "⠈"), (0, 1, "⠂"), (0, 3, "⡀"), (1, 3, "⢀")],  # Unicode: dots 1, 4, 2, 7, 8
)
def test_each_dot_of_a_cell(x: int, y: int, shown: str) -> None:
    canvas = Canvas(1, 1)
    canvas.dot(x, y)
    assert canvas.lines() == [shown]


def test_an_envelope_shows_a_single_peak_among_many_samples() -> None:
    y = np.zeros(10_000)
    y[4321] = 7.0
    found = envelope(np.linspace(0.0, 99.0, y.size), y, 100)
    assert max(high for _, _, high in found) == 7.0
    assert [column for column, _, _ in found] == list(range(100))


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20), st.floats(1e-3, 1e3))
def test_an_axis_holds_all_values_and_not_much_more(values: list[float], least: float) -> None:
    y_range = nice_range(np.array(values), least)
    span = max(max(values) - min(values), least)
    slack = 1e-6 * max(1.0, *(abs(value) for value in values))
    assert y_range.low <= min(values) + slack
    assert y_range.high >= max(values) - slack
    assert y_range.high - y_range.low <= 1.7 * span + slack  # two steps of at most 2.5 eighths each, at most


@given(st.integers(1, 30), st.integers(0, 200))
def test_a_ring_keeps_the_last_rows(length: int, rows: int) -> None:
    ring = Ring(length, 2)
    for k in range(rows):
        ring.append((float(k), float(-k)))
    kept = np.arange(max(0, rows - length), rows, dtype=float)
    np.testing.assert_array_equal(ring.rows(), np.column_stack([kept, -kept]))


LONG = " ".join(f"word{k}" for k in range(200))
"""Ten lines of a terminal of 80 columns, and more than a third of its page."""


def state(*texts: str) -> LiveState:
    live = LiveState("bus", PERIOD_S, None, can_drive=True)
    for text in texts:
        live.take(Notice(0, LogTopic.FAULT, text))
    return live


def test_the_title_says_what_part_is_shown() -> None:
    shown = state(*[LONG] * 3).snapshot()
    n_lines = len(log_lines(shown, 80))
    head = log(shown, 80, 11, top=4)[0]
    assert f"lines 5 to 14 of {n_lines}" in head
    assert "lines" not in log(shown, 80, n_lines + 1)[0]
    assert log(state().snapshot(), 80, 5)[1] == "nothing yet"


def shown_after(*keys: str, then: str = "") -> list[str]:
    """Lines of the log page after keys, and after one more entry."""
    live = state(*[f"{k} {LONG}" for k in range(5)])
    lines: list[str] = []

    async def go() -> None:
        app = MonitorApp(FakeSource(), live, page="log")
        async with app.run_test(size=(80, 24)) as pilot:
            await settled(pilot)
            await pilot.press(*keys)
            if then:
                live.take(Notice(0, LogTopic.FAULT, then))
            await settled(pilot)
            lines.extend(app.query_one(LogPanel).render().plain.splitlines())

    asyncio.run(go())
    return lines


@pytest.mark.campaign
def test_the_arrows_go_through_it_and_not_beyond() -> None:
    first, second, last = shown_after(), shown_after("down"), shown_after(*["pagedown"] * 20)
    assert second[1:-1] == first[2:]
    assert last[-1].split()[-1] == "word199"
    assert len(last) == len(first)
    assert shown_after("pagedown", *["pageup"] * 3) == first
