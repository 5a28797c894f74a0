"""``hil effects``: the catalogue of physics a diagnosis can name."""

from __future__ import annotations

from typing import Annotated

import typer

from hil.cli.completion import effect_names
from hil.cli.printing import new_console, say

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil effects backlash")
def effects(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="One effect; all of them without it.", autocompletion=effect_names),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """List the catalogue, or one entry: law, parameters, what excites it, what it is confused with."""
    from hil.report.catalogue import catalogue_table, effect_details, entries_text, select

    entries = select(name)
    if as_json:
        say(entries_text(entries), nl=False)
    elif name is None:
        new_console().print(catalogue_table(entries))
    else:
        new_console().print(effect_details(entries[0]))
