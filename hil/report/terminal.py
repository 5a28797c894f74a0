"""Blocks of a page on a terminal: texts and tables; figures and remarks on them stay in the page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal

from rich.console import Group, RenderableType
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
            yield _table(block)


def _words(block: html.Paragraph) -> str:
    return "".join(str(piece) for piece in block.pieces)


def _table(block: html.HtmlTable) -> Table:
    """Make a table of the columns that hold text; numbers are never cut."""
    columns = [i for i, _ in enumerate(block.headings) if any(str(row.cells[i]) for row in block.rows)]
    table = Table(box=None, pad_edge=False, show_header=any(block.headings))
    for i in columns:
        is_number = i in block.numbers
        justify: Literal["right", "left"] = "right" if is_number else "left"
        table.add_column(Text(block.headings[i]), justify=justify, overflow="fold", no_wrap=is_number)
    for row in block.rows:
        style = "dim" if row.kind == "undetermined" else ""
        table.add_row(*(Text(str(row.cells[i])) for i in columns), style=style)
    return table
