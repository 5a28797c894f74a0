"""The one way of the commands to print: whatever is foreign in a text, its control characters are shown, not done."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from hil.errors import UsageError
from hil.printable import shown

if TYPE_CHECKING:
    from rich.console import Console

    from hil.config.table import FileKind


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
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress as Bar,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

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


def ask_at_terminal(heading: str) -> Callable[[str, str, str], str]:
    """Return what asks: what for, the default (empty: none), what was wrong with the answer before (empty: nothing)."""
    say(f"{heading} Enter takes what stands in [brackets]; Ctrl-C writes nothing.")

    def ask(what: str, default: str, wrong: str) -> str:
        if wrong:
            say(f"  {wrong}")
        try:
            return input(f"{what}{f' [{default}]' if default else ''}: ")
        except EOFError as end:
            raise UsageError(f"{what}: expected an answer, got the end of the input") from end

    return ask


def print_schema(kind: FileKind, out: Path | None) -> None:
    """Print the JSON schema of a kind of file, or write it."""
    from hil.config.schema import schema_text
    from hil.result_folder import publish

    text = schema_text(kind)
    if out is None:
        say(text, nl=False)
    else:
        publish(out.parent, {out.name: lambda path: path.write_text(text, encoding="utf-8")})
