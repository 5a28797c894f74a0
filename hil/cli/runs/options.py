"""Arguments and options that the commands of ``hil runs`` share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Folder = Annotated[Path, typer.Option("--store", metavar="DIR", help="Folder of the recordings and runs.sqlite.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
RunId = Annotated[int, typer.Argument(metavar="RUN", help="Number of the run, as 'hil runs' lists it.")]
HERE = Path()
"""The folder where none is given."""
