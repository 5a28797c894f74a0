"""``hil runs note`` and ``hil runs attach``: what is added to a run by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.runs.opened import opened
from hil.cli.runs.options import HERE, Folder, RunId


def note(
    run: RunId,
    text: Annotated[str, typer.Argument(metavar="TEXT", help="Text of the note.")],
    store: Folder = HERE,
) -> None:
    """Write a note to a run."""
    with opened(store) as runs:
        runs.note(run, text)
    typer.echo(f"note written to run {run}")


def attach(
    run: RunId,
    kind: Annotated[str, typer.Argument(metavar="KIND", help="diagnosis, identification, model, or your own word.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Result of the run.")],
    store: Folder = HERE,
) -> None:
    """Attach a result to a run; its text is kept as it is now."""
    with opened(store) as runs:
        runs.attach(run, kind, file)
    typer.echo(f"{file} attached to run {run} as {kind}")
