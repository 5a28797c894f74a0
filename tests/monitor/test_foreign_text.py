"""Texts of devices, files and operators are shown as they are: no markup, no control of the terminal."""

import asyncio
import html
import re

import pytest

from hil.monitor.app import MonitorApp
from hil.monitor.messages import Began, Choice, LogTopic, Mark, Notice, Ready
from hil.monitor.panel import printable
from hil.monitor.state import LiveState
from tests.chosen import campaign
from tests.monitor.fake_source import PERIOD_S, FakeSource, settled

TEXT = "[bold]x[/]"
WRONG = "[/red] [[x]"
"""What a reader of markup refuses: the end of something that has not begun."""


def shown(*keys: str, text: str = TEXT, coming: tuple[object, ...] = ()) -> str:
    """What the screen shows after keys, line by line."""
    source = FakeSource(coming=[Ready(), *coming])  # type: ignore[list-item]
    app = MonitorApp(source, LiveState(text, PERIOD_S, None, True), (Choice(text, f"sum {text}"),), f"out {text}")
    drawn: list[str] = []

    async def go() -> None:
        async with app.run_test(size=(80, 24)) as pilot:
            await settled(pilot)
            for key in keys:
                await pilot.press(key)
            await settled(pilot)
            drawn.append(app.export_screenshot())

    asyncio.run(go())
    return html.unescape(re.sub(r"<[^>]*>", "", drawn[0])).replace("\xa0", " ")


@pytest.mark.parametrize("text", [TEXT, campaign(WRONG)])
def test_names_of_the_rig_file_and_the_folder(text: str) -> None:
    asked = shown("e", "enter", text=text)
    assert f"> {text}" in asked
    assert f"sum {text}" in asked
    assert f"run {text}, recorded in out {text}?" in asked
    assert text in shown(text=text)


@pytest.mark.campaign
def test_a_mark_is_sent_as_it_was_typed() -> None:
    source = FakeSource(coming=[Ready(), Began("cruise", "c.parquet", 30.0)])
    app = MonitorApp(source, LiveState("bus", PERIOD_S, None, True))

    async def go() -> None:
        async with app.run_test(size=(80, 24)) as pilot:
            await settled(pilot)
            await pilot.press("m", *TEXT, "enter")

    asyncio.run(go())
    (mark,) = source.sent
    assert isinstance(mark, Mark)
    assert mark.text == TEXT


def test_what_would_steer_the_terminal_is_a_dot() -> None:
    assert printable("a\x1b[2J\x07\tb ü ±") == "a·[2J··b ü ±"
    assert "\x1b" not in shown(coming=(Notice(0, LogTopic.EMCY, "a\x1b[2Jb"),))
    assert "a·[2Jb" in shown(coming=(Notice(0, LogTopic.EMCY, "a\x1b[2Jb"),))
