"""Blocks of a page on a terminal: texts and tables; figures and remarks on them stay in the page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from hil.report import page as html

COLOURS: Mapping[str, str] = {
    "explained": "blue",
    "partly_explained": "blue",
    "unexplained": "yellow",
    "no_mismatch": "green",
}


LEAST_LABELS = 12
"""Columns of a terminal that words need next to the numbers of a table: with fewer, numbers are folded, too."""


def rendered(blocks: Iterable[Any]) -> RenderableType:
    """Return what a terminal shows of blocks."""
    return Group(*(shown for block in blocks if block for shown in _rendered(block)))


def _rendered(block: Any) -> Iterator[RenderableType]:
    match block:
        case html.Header():
            said = Text("\n\n".join([block.title, *(_words(each) for each in block.blocks)]))
            badge = Text(f" {block.badge} ", style="bold")
            yield Panel(said, title=badge, border_style=COLOURS.get(block.kind, ""))
        case html.Section():
            yield Text(block.title, style="bold")
            yield rendered(block.blocks)
        case html.Paragraph():
            yield Text(_words(block))
        case html.HtmlTable():
            yield _Table(block)


def _words(block: html.Paragraph) -> str:
    return "".join(str(piece) for piece in block.pieces)


@dataclass(frozen=True)
class _Table:
    """A table whose numbers are whole where the terminal has room for them and for what they are of.

    Where words have too little room next to them, the headings of numbers go over several lines first.
    """

    block: html.HtmlTable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        block, room = self.block, options.max_width
        labels = [i for i, _ in enumerate(block.headings) if i not in block.numbers and any(self._cells(i))]
        texts = {i: [block.headings[i], *self._cells(i)] for i in labels}
        widths = {i: max(len(word) for text in texts[i] for word in text.split(" ")) for i in labels}
        words = sum(widths.values()) + 2 * len(widths)
        folded = {i: block.headings[i].replace(" ", "\n") for i in block.numbers}
        whole, least = (
            sum(max(map(len, [*headings[i].split("\n"), *self._cells(i)])) + 2 for i in block.numbers)
            for headings in (block.headings, folded)
        )
        is_room = whole + words <= room
        headings = [each if is_room else folded.get(i, each) for i, each in enumerate(block.headings)]
        spare = room - words - (whole if is_room else least)
        is_fixed = spare >= 0 and bool(block.numbers)  # of words alone the library divides the room better
        for i in labels if is_fixed else ():
            more = min(spare, max(map(len, texts[i])) - widths[i])
            widths[i], spare = widths[i] + more, spare - more
        yield _table(block, headings, widths if is_fixed else {}, is_whole=least + LEAST_LABELS <= room)

    def _cells(self, column: int) -> list[str]:
        return [str(row.cells[column]) for row in self.block.rows]


def _table(block: html.HtmlTable, headings: Sequence[str], widths: Mapping[int, int], is_whole: bool) -> Table:
    """Make a table of the columns that hold text, some of them of given widths."""
    columns = [i for i, _ in enumerate(headings) if any(str(row.cells[i]) for row in block.rows)]
    table = Table(box=None, pad_edge=False, show_header=any(headings))
    for i in columns:
        is_number = i in block.numbers
        justify: Literal["right", "left"] = "right" if is_number else "left"
        whole = is_number and is_whole
        table.add_column(Text(headings[i]), justify=justify, overflow="fold", no_wrap=whole, width=widths.get(i))
    for row in block.rows:
        style = "dim" if row.kind == "undetermined" else ""
        table.add_row(*(Text(str(row.cells[i])) for i in columns), style=style)
    return table
