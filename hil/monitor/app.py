"""The full-screen view: draws the latest snapshot a few times a second, and turns keys into orders."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Any, ClassVar

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.events import Resize
from textual.widgets import Static

from hil.monitor import panel as head_panels
from hil.monitor.dialogs import HELP, HelpDialog, MarkDialog, StartDialog, key_line
from hil.monitor.layout import CSS, LEAST_COLUMNS, LEAST_ROWS, PAGES, WIDE_COLUMNS, WIDE_ROWS, pages
from hil.monitor.messages import Choice, LogTopic, Mark, Notice, Quit, Reset, StartExperiment, Stop
from hil.monitor.panel import LogPanel, Panel
from hil.monitor.snapshot import Activity
from hil.monitor.source import Source
from hil.monitor.state import LiveState
from hil.rig.stop import STOP_SIGNALS

DRAW_EVERY_S = 0.125
"""Eight pictures a second."""

_NOT_OURS = re.compile(r"@font-face\s*\{[^}]*\}|<!--.*?-->", re.DOTALL)
"""Fonts from the network, which a picture must do without, and a generator's name."""

INTERRUPTED = 130
"""Exit status, as `hil.cli.main` has it; that module is not to be imported from below."""

LAST_WORDS_S = 5.0
"""Time from the end of the rig to an end without ceremony, after a stop signal [s]."""


class MonitorApp(App[None]):
    """The view."""

    CSS = CSS
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("e", "start", "Start"),
        Binding("space,x", "stop", "Stop"),
        Binding("m", "mark", "Mark"),
        Binding("r", "reset", "Reset"),
        Binding("q", "leave", "Quit"),
        Binding("ctrl+c,ctrl+q", "interrupt", "Interrupt", priority=True),
        Binding("question_mark", "help", "Help"),
        Binding("plus,equals_sign", "zoom(-1)", "Shorter window"),
        Binding("minus", "zoom(1)", "Longer window"),
        Binding("down", "scroll(1)", "Down the log"),
        Binding("up", "scroll(-1)", "Up the log"),
        Binding("pagedown", "scroll(1, True)", "Page down the log"),
        Binding("pageup", "scroll(-1, True)", "Page up the log"),
        Binding("tab", "turn(1)", "Next page", priority=True),
        Binding("shift+tab", "turn(-1)", "Page before", priority=True),
        *(Binding(str(number + 1), f"page('{name}')", name) for number, name in enumerate(PAGES)),
    ]

    def __init__(
        self,
        source: Source,
        state: LiveState,
        choices: Sequence[Choice] = (),
        out: str = "",
        page: str = PAGES[0],
        picture: tuple[Path, float] | None = None,
    ) -> None:
        super().__init__(ansi_color=True)
        self._source = source
        self._state = state
        self._choices = choices
        self._out = out
        self._picture = picture
        self._page = page
        self._leaving = False
        self._heard_s = time.monotonic()
        self._handlers: dict[int, Any] = {}
        self.interrupted = False

    def compose(self) -> ComposeResult:
        """Yield the head line, every page, the message and the keys."""
        yield Panel(head_panels.headline, "headline")
        yield from pages(len(self._state.channel_units))
        yield Static("", id="too-small")
        yield Panel(head_panels.message, "message")
        yield Static("", id="keys", classes="keys", markup=False)

    def on_mount(self) -> None:
        """Begin to draw, and take the stop signals that are not ignored."""
        self.action_page(self._page)
        self.set_interval(DRAW_EVERY_S, self._tick)
        if self._picture is not None:
            self.set_timer(self._picture[1], self._take_picture)
        self._events = asyncio.get_running_loop()
        if threading.current_thread() is threading.main_thread():
            for number in STOP_SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
                    self._handlers[number] = signal.signal(number, self._on_signal)

    def on_unmount(self) -> None:
        """Give the stop signals back."""
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        self._handlers.clear()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        """Quit; a terminal that is gone may hold the screen's last words up for ever, so the end is seen to."""
        threading.Thread(target=_end_for_good, args=(self._source,), name="last resort", daemon=True).start()
        self._events.call_soon_threadsafe(self.action_interrupt)

    def on_resize(self, event: Resize) -> None:
        """Fit the layout to the terminal."""
        columns, rows = event.size
        small = columns < LEAST_COLUMNS or rows < LEAST_ROWS
        self.screen_stack[0].set_class(small, "small")
        self.screen_stack[0].set_class(columns >= WIDE_COLUMNS and rows >= WIDE_ROWS, "wide")
        text = (
            f"The terminal has {columns} x {rows}; the view needs {LEAST_COLUMNS} x {LEAST_ROWS}. Make it larger.\n"
            "SPACE still stops, q still quits."
        )
        self.screen_stack[0].query_one("#too-small", Static).update(text)

    def _tick(self) -> None:
        for report in self._source.poll():
            self._state.take(report)
            self._heard_s = time.monotonic()
        self._draw()
        if self._state.ended is not None and (self._leaving or self._state.ended.error is not None):
            self.exit()

    def _draw(self) -> None:
        if not self.screen_stack:
            return  # the view is ending: its clock may outlive its screens
        snapshot = self._state.snapshot(time.monotonic() - self._heard_s)
        for panel in self.screen_stack[0].query(Panel):
            panel.show(snapshot)

    def _take_picture(self) -> None:
        if self._picture is None:
            return
        path, _ = self._picture
        drawn = self.export_screenshot(title="hil monitor")
        path.write_text(_NOT_OURS.sub("", drawn), encoding="utf-8")
        self.action_leave()

    def action_page(self, name: str) -> None:
        """Show a page of `PAGES`, and the keys that count there."""
        self._page = name
        for container in self.screen_stack[0].query(".page").results(Container):
            container.set_class(container.id == name, "shown")
        self.screen_stack[0].query_one("#keys", Static).update(key_line(self._page, self._source.can_drive))
        self.call_after_refresh(self._draw)

    def action_scroll(self, by: int, pages: bool = False) -> None:
        """Go down the log, or up, by a line or a page."""
        if self._page == "log" and len(self.screen_stack) == 1:
            log = self.screen_stack[0].query_one(LogPanel)
            log.scroll_lines(by * (log.page_lines if pages else 1))

    def action_turn(self, by: int) -> None:
        """Show the next page, or the one before; in a dialog the key is the dialog's."""
        if len(self.screen_stack) > 1:
            (self.screen.focus_next if by > 0 else self.screen.focus_previous)()
            return
        self.action_page(PAGES[(PAGES.index(self._page) + by) % len(PAGES)])

    def action_zoom(self, by: int) -> None:
        """Let the plots of the signals reach back further, or less far."""
        self._state.zoom(by)
        self._draw()

    def action_start(self) -> None:
        """Open the choice of an experiment; only while a rig is listened to."""
        if self._refuse(self._state.activity is Activity.LISTENING, "only a rig that is listened to can be started"):
            return
        if self._refuse(bool(self._choices), "the rig file has no [experiments]"):
            return
        self.push_screen(StartDialog(self._choices, self._out), self._start)

    def _start(self, name: str | None) -> None:
        if name is None or self._state.activity is not Activity.LISTENING:
            return
        self._state.starting(name)
        self._source.send(StartExperiment(name))

    def action_stop(self) -> None:
        """Order the end of the run at zero torque; it is sent whatever the screen says."""
        self._source.send(Stop())
        self._state.stopping("stop: zero torque, disarming")

    def action_mark(self) -> None:
        """Ask what to note; the mark has the time of the key."""
        t_ns = time.monotonic_ns()
        if self._refuse(self._state.is_driving, "a mark goes into a recording; nothing is being recorded"):
            return
        self.push_screen(MarkDialog(), lambda text: None if text is None else self._source.send(Mark(t_ns, text)))

    def action_reset(self) -> None:
        """Order a reset of the drives' faults; only while a rig is listened to."""
        if self._refuse(self._state.activity is Activity.LISTENING, "stop first: faults are reset at rest"):
            return
        self._state.take(Notice(time.monotonic_ns(), LogTopic.INFO, "reset of the drives' faults asked for"))
        self._source.send(Reset())

    def action_help(self) -> None:
        """Show the keys, and what the words mean."""
        self.push_screen(HelpDialog(HELP))

    def action_leave(self) -> None:
        """Quit: at once where nothing can drive, else when the rig's process has said that it has ended."""
        if self._leaving or not self._source.can_drive or self._state.ended is not None:
            self.exit()
            return
        self._leaving = True
        self._source.send(Quit())
        self._state.say("ending: zero torque, drives disarmed")
        self._state.stopping("ending: zero torque, disarming")

    def action_interrupt(self) -> None:
        """Quit as by Ctrl-C."""
        self.interrupted = True
        self.action_leave()

    def _refuse(self, allowed: bool, why_not: str) -> bool:
        """Tell why a key does nothing now; True where it does nothing."""
        allowed = allowed and self._source.can_drive
        if allowed:
            self._state.say("")  # what was refused before is no news any more
        else:
            self._state.say(why_not if self._source.can_drive else "a recording is played: there is no rig to drive")
        return not allowed


def _end_for_good(source: Source) -> None:
    """End this program if it has not ended by itself soon after the rig has; a rig that has not ends without it."""
    source.await_end()
    time.sleep(LAST_WORDS_S)
    os._exit(INTERRUPTED)
