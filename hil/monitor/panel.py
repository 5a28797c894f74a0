"""One panel of the screen: asks a drawing function for as many lines as it has room for."""

from __future__ import annotations

from collections.abc import Callable

from rich.text import Text
from textual.widget import Widget

from hil.monitor.snapshot import Snapshot
from hil.printable import printable as printable

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


def drawn(draw: Draw, snapshot: Snapshot, width: int, height: int) -> list[str]:
    """Return a panel's lines, none of them outside its room, whatever that is."""
    if width < LEAST_WIDTH or height < 1:
        return []
    return [line[:width] for line in draw(snapshot, width, height)][:height]


class Panel(Widget):
    """Draws the latest snapshot; nothing until there is one.

    Parameters
    ----------
    draw
        What gives its lines.
    name
        Its name and its CSS class.
    """

    def __init__(self, draw: Draw, name: str) -> None:
        super().__init__(name=name, classes=f"panel {name}")
        self._draw = draw
        self._snapshot: Snapshot | None = None

    def show(self, snapshot: Snapshot) -> None:
        """Draw another snapshot."""
        self._snapshot = snapshot
        if self.is_on_screen:
            self.refresh()

    def render(self) -> Text:
        """Draw for the present size."""
        width, height = self.size
        if self._snapshot is None:
            return Text("")
        lines = map(printable, drawn(self._draw, self._snapshot, width, height))
        text = Text("\n".join(lines), no_wrap=True, end="")  # never markup: names and texts are other people's
        text.highlight_words(STRONG, "bold")
        return text
