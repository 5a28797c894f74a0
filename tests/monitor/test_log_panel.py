"""The log page: every entry can be read to its end, and reading is not disturbed by what comes."""

import asyncio

import pytest

from hil.monitor.app import MonitorApp
from hil.monitor.messages import Kind, Notice
from hil.monitor.panel import LogPanel, log, log_lines
from hil.monitor.state import LiveState
from tests.monitor.fake_source import PERIOD_S, FakeSource, settled

LONG = " ".join(f"word{k}" for k in range(200))
"""Ten lines of a terminal of 80 columns, and more than a third of its page."""


def state(*texts: str) -> LiveState:
    live = LiveState("bus", PERIOD_S, None, can_drive=True)
    for text in texts:
        live.take(Notice(0, Kind.FAULT, text))
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
                live.take(Notice(0, Kind.FAULT, then))
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
