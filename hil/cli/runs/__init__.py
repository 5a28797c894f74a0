"""``hil runs``: what was run, with what, and what came of it; one file per command."""

from __future__ import annotations

import typer

from hil.cli.runs.compare import compare
from hil.cli.runs.delete import delete
from hil.cli.runs.export import export
from hil.cli.runs.listing import listed
from hil.cli.runs.rebuild import rebuild
from hil.cli.runs.remarks import attach, note
from hil.cli.runs.show import show

__all__ = ["app"]

app = typer.Typer(
    add_completion=False,
    epilog="Example: hil runs --experiment cruise --since 2026-11-01. One of them: hil runs show 3",
)
app.callback(invoke_without_command=True)(listed)
app.command(epilog="Example: hil runs show 3")(show)
app.command(epilog="Example: hil runs compare 3 7")(compare)
app.command(epilog='Example: hil runs note 3 "Wind from the left, second gear"')(note)
app.command(epilog="Example: hil runs attach 3 diagnosis out/diagnosis.json")(attach)
app.command(epilog="Example: hil runs delete 3 --with-recording")(delete)
app.command(epilog="Example: hil runs export 3 7 --out for_the_office.zip")(export)
app.command(epilog="Example: hil runs rebuild --store recordings")(rebuild)
