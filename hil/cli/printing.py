"""The one way of the commands to print: whatever is foreign in a text, its control characters are shown, not done."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import typer

from hil.printable import shown

if TYPE_CHECKING:
    from rich.console import Console


def say(text: object = "", err: bool = False, nl: bool = True) -> None:
    """Print a text."""
    typer.echo(shown(str(text)), err=err, nl=nl)


def new_console(**options: Any) -> Console:
    """Return a console for tables and progress that shows control characters likewise."""
    from rich.console import Console, RenderHook

    class Shown(RenderHook):
        def process_renderables(self, renderables: list[Any]) -> list[Any]:
            return [_Filtered(each) for each in renderables]

    made = Console(**options)
    made.push_render_hook(Shown())
    return made


class _Filtered:
    def __init__(self, content: Any) -> None:
        self._content = content

    def __rich_console__(self, console: Any, options: Any) -> Iterator[Any]:
        from rich.segment import Segment

        for segment in console.render(self._content, options):
            yield segment if segment.control else Segment(shown(segment.text), segment.style)
