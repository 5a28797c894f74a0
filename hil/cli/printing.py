"""The one way of the commands to print: whatever is foreign in a text, its control characters are shown, not done.

And help texts that flow: a paragraph of a docstring is one paragraph on the terminal, whatever its width. Typer joins
the lines of the first paragraph only and prints the others as they are broken in the source, which on 80 columns leaves
single words on lines of their own.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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


@contextmanager
def progress_bar() -> Iterator[Callable[[str, int, int], None]]:
    """Show what is done on standard error, with the time taken and left."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    console = new_console(stderr=True)
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)


class _Filtered:
    def __init__(self, content: Any) -> None:
        self._content = content

    def __rich_console__(self, console: Any, options: Any) -> Iterator[Any]:
        from rich.segment import Segment

        for segment in console.render(self._content, options):
            yield segment if segment.control else Segment(shown(segment.text), segment.style)


def flow(app: typer.Typer) -> None:
    """Let the help of every command of an application, and of its groups, flow."""
    infos: list[Any] = [*app.registered_commands, app.registered_callback]
    for info in infos:
        if info is not None and info.callback is not None:
            text = info.help if isinstance(info.help, str) else info.callback.__doc__
            info.help = flowing(text or "")
    for group in app.registered_groups:
        if group.typer_instance:
            flow(group.typer_instance)


def flowing(text: str) -> str:
    """Join the lines of each paragraph; a paragraph with an indented line, such as a list, stays as it is."""
    paragraphs = re.split(r"\n\s*\n", inspect.cleandoc(text))
    return "\n\n".join(part if "\n " in part else part.replace("\n", " ") for part in paragraphs)
