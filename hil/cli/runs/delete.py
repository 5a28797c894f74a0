"""``hil runs delete``: a run out of the store, after asking."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from hil.cli.runs.opened import opened
from hil.cli.runs.options import HERE, Folder, RunId
from hil.errors import UsageError


def delete(
    run: RunId,
    with_recording: Annotated[bool, typer.Option("--with-recording", help="The recording's file too.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Don't ask; for scripts.")] = False,
    store: Folder = HERE,
) -> None:
    """Delete a run from the store, after asking; its recording stays, except with --with-recording.

    While the recording exists, 'hil runs rebuild' enters it again.
    """
    from hil.store.remove import remove_files, require_own

    with opened(store) as runs:
        found = runs.get(run)
        if with_recording:
            require_own(found.entry)
        what = f"run {run}, {found.entry.experiment} of {found.entry.started_utc}"
        _confirm(f"delete {what}{f', and {found.entry.recording}' if with_recording else ''}?", yes)
        runs.delete(run)
    removed = remove_files(found.entry) if with_recording else []
    typer.echo(f"deleted {what}")
    for path in removed:
        typer.echo(f"deleted {path}")


def _confirm(question: str, yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        raise UsageError(f"{question} Expected --yes, for nobody can be asked here. Nothing was deleted.")
    if not typer.confirm(question):
        raise UsageError("Not confirmed. Nothing was deleted.")
