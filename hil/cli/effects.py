"""``hil effects``: the catalogue of physics a diagnosis can name, and a new law from a table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.completion import effect_names
from hil.cli.printing import new_console, say
from hil.errors import UsageError

app = typer.Typer(add_completion=False)

NEW = "new"


@app.command(epilog="Example: hil effects new --from mine/augmented.toml --name freewheel --out laws")
def effects(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME]",
            help="One effect; all of them without it; new: a law of your own, from a table.",
            autocompletion=effect_names,
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
    source: Annotated[
        Path | None,
        typer.Option("--from", metavar="AUGMENTED", help="With new: model file with a [tables.…] of a diagnosis."),
    ] = None,
    table: Annotated[
        str | None, typer.Option("--table", metavar="PLACE", help="With new: which table, where there are several.")
    ] = None,
    law: Annotated[str, typer.Option("--name", help="With new: name of the law.")] = "my_law",
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="With new: folder for its files.")] = Path(),
) -> None:
    """List the catalogue, or one entry: law, parameters, what excites it, what it is confused with.

    hil effects new writes a law of your own from the table of a diagnosis: function, parameters, start, and the words
    to fill in. With it the next machine of this kind has a name for what it does.
    """
    if name == NEW:
        _write_new(source, law, table, out)
        return
    if source is not None or table is not None:
        raise UsageError("hil effects: expected --from and --table with new only: hil effects new --from AUGMENTED")
    from hil.report.catalogue import catalogue_table, effect_details, entries_text, select

    entries = select(name)
    if as_json:
        say(entries_text(entries), nl=False)
    elif name is None:
        new_console().print(catalogue_table(entries))
    else:
        new_console().print(effect_details(entries[0]))


def _write_new(source: Path | None, law: str, table: str | None, out: Path) -> None:
    """Write a law of the user's own; nothing that is there is replaced, for words were filled in."""
    if source is None:
        raise UsageError("hil effects new: expected --from AUGMENTED, a model file with a table, got none")
    from hil.config.new_law import declaration
    from hil.result_folder import publish

    files = declaration(source, law, table)
    if there := [path for path in (out / name for name in files) if path.exists()]:
        raise UsageError(f"{there[0]}: expected a new file, got one that is there. Choose another --name or --out.")

    def write(path: Path) -> None:
        path.write_text(files[path.name], encoding="utf-8")

    publish(out, dict.fromkeys(files, write))
    say(f"{out / law}.py, {law}.toml: fill in the words marked TODO; the .toml goes into the next model file")
