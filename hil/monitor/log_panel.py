"""The log page: every entry in full, the latest first; the arrows go back in it."""

from __future__ import annotations

import textwrap

from textual.events import Resize

from hil.monitor.messages import Notice
from hil.monitor.panel import Panel
from hil.monitor.plot import title
from hil.monitor.snapshot import Snapshot

NS_PER_S = 1_000_000_000

TIME, KIND = 10, 5
"""Characters of the time and of the kind before an entry's text; a blank follows each."""


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
        """Draw another snapshot."""
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
        """How many lines it shows at once."""
        return max(1, self.size.height - 1)

    def _log(self, snapshot: Snapshot, width: int, height: int) -> list[str]:
        self._top = max(0, min(self._top, self._n_lines - self.page_lines))
        return log(snapshot, width, height, self._top)
