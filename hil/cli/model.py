"""``hil model``: what helps to write a model file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(add_completion=False, no_args_is_help=True)


@app.callback(epilog="Example: hil model schema --out model.schema.json")
def model() -> None:
    """Help to write a model file."""


@app.command(epilog="Example: hil model schema --out model.schema.json")
def schema(
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write; else it is printed.")
    ] = None,
) -> None:
    """Print the JSON schema of model files, for editors that read `#:schema ./model.schema.json`."""
    from hil.config.file_schema import FileKind
    from hil.config.schema import schema_text
    from hil.report.outputs import publish

    text = schema_text(FileKind.MODEL)
    if out is None:
        typer.echo(text, nl=False)
    else:
        publish(out.parent, {out.name: lambda path: path.write_text(text, encoding="utf-8")})
