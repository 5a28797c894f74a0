"""Panels of the screen: what every one has, the lines above and below, and the log."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable

from rich.text import Text
from textual.events import Resize
from textual.widget import Widget

from hil.monitor.messages import Notice
from hil.monitor.plot import title
from hil.monitor.snapshot import SILENT_AFTER_S, Activity, Headline, Snapshot
from hil.printable import printable as printable
from hil.rig.pacing import NS_PER_S

Draw = Callable[[Snapshot, int, int], list[str]]
"""``draw(snapshot, width, height)``: at most ``height`` lines of at most ``width`` characters."""

STRONG = (
    *("ALARM", "FAULT", "EMCY 0x", "ACTIVE", "STALE", "TROUBLE", "LOST", "NO PERMIT", "WITHDRAWN", "ENDED EARLY"),
    *("STANDS STILL", "NO VALUE", "NO NEWS", "FLAGGED", "UNSURE"),
)
"""Words that are set in bold: what they say is in the word, not in its look."""


LEAST_WIDTH = 10
"""A panel that is narrower shows nothing: an axis alone takes as much. A terminal passes through any size while it is
resized."""

MORE = "… (5: log)"

QUIET = (Activity.CONNECTING, Activity.STARTING, Activity.LOST, Activity.PLAYED, Activity.ENDED)
"""When it is no news that nothing comes."""

TIME, KIND = 10, 5
"""Characters of the time and of the kind before an entry's text; a blank follows each."""


def drawn(draw: Draw, snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Return a panel's lines, none of them outside its room, whatever that is."""
    if width < LEAST_WIDTH or height < 1:
        return []
    return [line[:width] for line in draw(snapshot, width, height)][:height]


class Panel(Widget):
    """Draws the latest snapshot; nothing until there is one."""

    def __init__(self, draw: Draw, name: str) -> None:
        super().__init__(name=name, classes=f"panel {name}")
        self._draw = draw
        self._snapshot: Snapshot | None = None

    def show(self, snapshot: Snapshot) -> None:
        """Take the latest snapshot, and draw it where the panel is on the screen."""
        self._snapshot = snapshot
        if self.is_on_screen:
            self.refresh()

    def render(self) -> Text:
        """Return its lines as text without markup."""
        width, height = self.size
        if self._snapshot is None:
            return Text("")
        lines = map(printable, drawn(self._draw, self._snapshot, width, height))
        text = Text("\n".join(lines), no_wrap=True, end="")  # never markup: names and texts are other people's
        text.highlight_words(STRONG, "bold")
        return text


def headline(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """One line: activity, run, phase and time on the left, the rig's name on the right."""
    head = snapshot.headline
    silent = head.silent_s > SILENT_AFTER_S and head.activity not in QUIET
    left = doing(head) + (f", NO NEWS for {head.silent_s:.0f} s" if silent else "")
    room = width - len(left) - 2
    name = head.rig if len(head.rig) <= room else head.rig[: max(0, room - 1)] + "…"
    return [f"{left}{name:>{max(0, width - len(left))}}"[:width]]


def doing(head: Headline) -> str:
    """Tell in words what is happening."""
    if head.activity in (Activity.RUNNING, Activity.STOPPING, Activity.STARTING, Activity.REPLAYING):
        time_s = "" if math.isnan(head.phase_s) else f" {head.phase_s:.1f} s"
        of = f" of {head.duration_s:g} s" if head.phase in ("measure", "") and math.isfinite(head.duration_s) else ""
        return " ".join(f"{head.activity.value} {head.experiment} {head.phase}{time_s}{of}".split())
    word: str = head.activity.value
    return word


def message(snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Give the last thing the operator has to know; what has no room is on the log page."""
    text = " ".join(snapshot.headline.message.split())
    return [text if len(text) <= width else (text[: max(0, width - len(MORE))] + MORE)[:width]]


def log(snapshot: Snapshot, width: int, height: int, top: int = 0) -> list[str]:
    """List what happened, from line ``top`` of the log on, under a title that says what part of it this is."""
    lines = log_lines(snapshot, width)
    shown = lines[top : top + height - 1]
    runs = f"{snapshot.runs} run{'' if snapshot.runs == 1 else 's'}"
    part = f"lines {top + 1} to {top + len(shown)} of {len(lines)}: arrows, " if len(shown) < len(lines) else ""
    head = title("log, latest first", f"{part}{runs}", width)
    return [head, *(shown or ["nothing yet"[:width]])][: max(height, 1)]


def log_lines(snapshot: Snapshot, width: int) -> list[str]:
    """Give all lines of the log; an entry takes as many as it needs."""
    lines = []
    for notice in reversed(snapshot.log):
        lines += _entry(notice, (snapshot.now_ns - notice.t_ns) / NS_PER_S, width)
    return lines


def _entry(notice: Notice, age_s: float, width: int) -> list[str]:
    head = f"{ago(age_s):>{TIME}} {notice.kind.value:<{KIND}} "
    room = max(1, width - len(head))
    first, *others = textwrap.wrap(notice.text, room) or [""]
    return [f"{head}{first}"[:width], *(f"{'':{len(head)}}{line}"[:width] for line in others)]


def ago(age_s: float) -> str:
    """Say how long ago something was: in seconds below 100 s, in minutes below 100 min; never in the future."""
    seconds = round(max(age_s, 0.0))
    if seconds < 100:
        return f"{seconds} s ago"
    minutes = round(seconds / 60)
    return f"{minutes} min ago" if minutes < 100 else f"{minutes / 60:.0f} h ago"


class LogPanel(Panel):
    """The log with a place in it, which stays at the lines being read while others come above them."""

    def __init__(self) -> None:
        super().__init__(self._log, "log-page")
        self._top = 0
        self._n_lines = 0

    def show(self, snapshot: Snapshot) -> None:
        """Take the latest snapshot; the lines being read stay where they are."""
        n_lines = len(log_lines(snapshot, self.size.width)) if self.size.width else 0
        if self._top and self._n_lines:
            self._top += max(0, n_lines - self._n_lines)
        self._n_lines = n_lines
        super().show(snapshot)

    def on_resize(self, event: Resize) -> None:
        """Begin at the top again: at another width the lines are others."""
        self._top = self._n_lines = 0

    def scroll_lines(self, lines: int) -> None:
        """Go so many lines down the log; up where it is negative."""
        self._top += lines
        self.refresh()

    @property
    def page_lines(self) -> int:
        """Lines of the log that have room, 1 at least."""
        return max(1, self.size.height - 1)

    def _log(self, snapshot: Snapshot, width: int, height: int) -> list[str]:
        self._top = max(0, min(self._top, self._n_lines - self.page_lines))
        return log(snapshot, width, height, self._top)
