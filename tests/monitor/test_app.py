"""Keys of the view against a source that remembers what it was sent."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import pytest
from textual.pilot import Pilot

from hil.monitor.app import MonitorApp
from hil.monitor.layout import PAGES
from hil.monitor.messages import Began, Choice, Ended, Mark, Quit, Ready, Reset, Samples, Start, Stop
from hil.monitor.panel import Panel
from hil.monitor.snapshot import Activity
from hil.monitor.state import LiveState
from tests.monitor.fake_source import PERIOD_S, FakeSource, ended, sample, settled
from tests.monitor.test_panels import snapshot

CHOICES = (Choice("cruise", "holds a speed"), Choice("tip", "steps the torque"))

Script = Callable[[Pilot[None], FakeSource, MonitorApp], Awaitable[None]]


def play(script: Script, source: FakeSource | None = None) -> tuple[FakeSource, MonitorApp]:
    """Run a script of keys against the view at 80 by 24."""
    source = source or FakeSource()
    app = MonitorApp(source, LiveState("bus", PERIOD_S, None, source.can_drive), CHOICES, "runs")

    async def go() -> None:
        async with app.run_test(size=(80, 24)) as pilot:
            await settled(pilot)
            await script(pilot, source, app)

    asyncio.run(go())
    return source, app


def activity(app: MonitorApp) -> Activity:
    return app._state.activity


def test_nothing_starts_without_the_second_key() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("e", "y", "down", "y")
        assert source.sent == []
        await pilot.press("enter", "up", "y")  # another one under the bar: the question is gone
        assert source.sent == []
        await pilot.press("enter", "escape")
        assert source.sent == []
        await pilot.press("e", "down", "enter", "y")
        assert source.sent == [Start("tip")]
        assert activity(app) is Activity.STARTING

    play(script)


def test_stop_at_once_by_either_key_and_from_the_help() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        source.coming = [Began("cruise", "runs/c.parquet", 30.0)]
        await settled(pilot)
        await pilot.press("space", "x", "question_mark", "space")
        assert source.sent == [Stop(), Stop(), Stop()]
        assert activity(app) is Activity.STOPPING

    play(script)


def test_a_mark_has_the_time_of_its_key_and_the_text_typed() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("m")
        assert source.sent == []  # nothing is being recorded
        source.coming = [Began("cruise", "runs/c.parquet", 30.0)]
        await settled(pilot)
        await pilot.press("m", *"axe x", "enter")
        await pilot.press("m", "enter")
        await pilot.press("m", "escape")

    source, _ = play(script)
    first, second = source.sent
    assert isinstance(first, Mark)
    assert isinstance(second, Mark)
    assert (first.text, second.text) == ("axe x", "mark")
    assert first.t_ns < second.t_ns


def test_faults_are_reset_at_rest_only() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("r")
        source.coming = [Began("cruise", "runs/c.parquet", 30.0)]
        await settled(pilot)
        await pilot.press("r")

    source, _ = play(script)
    assert source.sent == [Reset()]


@pytest.mark.parametrize(("key", "interrupted"), [("q", False), ("ctrl+c", True)])
def test_quitting_waits_for_the_rig_to_end(key: str, interrupted: bool) -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press(key)
        await settled(pilot)
        assert source.sent == [Quit()]
        assert app.is_running
        source.coming = [Ended()]
        await ended(app)

    _, app = play(script)
    assert app.interrupted is interrupted


def test_a_second_interrupt_does_not_wait() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("ctrl+c", "ctrl+c")
        await ended(app)

    play(script)


def test_a_source_that_fails_ends_the_view() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        source.coming = [Ended("CAN bus: gone")]
        await ended(app)

    _, app = play(script)
    assert app._state.ended == Ended("CAN bus: gone")


def test_a_recording_takes_no_orders() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("e", "m", "r")
        assert source.sent == []
        assert "no rig to drive" in app._state.snapshot().headline.message
        await pilot.press("q")
        await ended(app)

    play(script, FakeSource(can_drive=False, coming=[]))


def test_pages_by_number_and_in_turn() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        seen = []
        for key in ("5", "tab", "tab", "shift+tab", "3"):
            await pilot.press(key)
            await settled(pilot)
            seen += [page.id for page in app.query(".page") if page.display]
        assert seen == ["log", "overview", "model", "overview", "resonance"]

    play(script)


def test_nothing_to_start_while_the_rig_is_not_there() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("e", "enter", "y")
        assert source.sent == []
        source.coming = [Ready()]
        await settled(pilot)
        await pilot.press("e", "enter", "y")
        assert source.sent == [Start("cruise")]

    play(script, FakeSource(coming=[]))


def test_a_picture_is_drawn_and_the_view_ends(tmp_path: Path) -> None:
    source = FakeSource(can_drive=False, coming=[])
    picture = tmp_path / "view.svg"
    app = MonitorApp(source, LiveState("bus", PERIOD_S, None, False), picture=(picture, 0.3))
    app.run(headless=True, size=(80, 24))
    drawn = picture.read_text(encoding="utf-8")
    assert "torque" in drawn
    assert "url(" not in drawn.replace("url(#", "")  # nothing from the network


@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=[pytest.mark.campaign] * (page not in ("overview", "model"))) for page in PAGES]
)
def test_the_view_survives_every_resize_while_a_model_is_shown(page: str) -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        shown = snapshot()
        app._state.snapshot = lambda heard_s=0.0: shown  # type: ignore[method-assign]
        await pilot.press(str(PAGES.index(page) + 1))
        for size in ((60, 20), (200, 50), (1, 1), (130, 40), (80, 2), (3, 60), (80, 24)):
            await pilot.resize_terminal(*size)
            app._draw()
            await pilot.pause()
            assert app.is_running

    play(script)


def test_further_channels_stand_on_the_first_page() -> None:
    units = {"speed_load_rad_s": "rad/s"}
    source = FakeSource(coming=[Ready(), Samples(((replace(sample(0), channels=(12.5,)), None),))])
    app = MonitorApp(source, LiveState("bus", PERIOD_S, None, True, channel_units=units))

    async def go() -> None:
        async with app.run_test(size=(80, 24)) as pilot:
            await settled(pilot)
            (panel,) = app.query(".channels").results(Panel)
            assert panel.size.height == 1
            assert str(panel.render()).split() == ["speed_load_rad_s", "[rad/s]", "12.5"]
            for name in ("torque", "speed", "prbs", "twist"):
                assert app.query_one(f".{name}").size.height >= 3

    asyncio.run(go())
