"""Keys of the view against a source that remembers what it was sent."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from textual.pilot import Pilot

from hil.monitor.app import MonitorApp
from hil.monitor.layout import PAGES
from hil.monitor.messages import Began, Choice, Ended, Quit, Ready, StartExperiment, Stop
from hil.monitor.snapshot import Activity
from hil.monitor.state import LiveState
from tests.monitor.fake_source import PERIOD_S, FakeSource, ended, settled
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
        assert source.sent == [StartExperiment("tip")]
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


@pytest.mark.campaign
def test_a_recording_takes_no_orders() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("e", "m", "r")
        assert source.sent == []
        assert "no rig to drive" in app._state.snapshot().headline.message
        await pilot.press("q")
        await ended(app)

    play(script, FakeSource(can_drive=False, coming=[]))


def test_nothing_to_start_while_the_rig_is_not_there() -> None:
    async def script(pilot: Pilot[None], source: FakeSource, app: MonitorApp) -> None:
        await pilot.press("e", "enter", "y")
        assert source.sent == []
        source.coming = [Ready()]
        await settled(pilot)
        await pilot.press("e", "enter", "y")
        assert source.sent == [StartExperiment("cruise")]

    play(script, FakeSource(coming=[]))


@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=[pytest.mark.campaign] * (page != "model")) for page in PAGES]
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
