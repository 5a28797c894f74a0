"""``--dbc`` of the commands that read recordings, and how they tell what was recognised in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.printing import say
from hil.cli.silence import is_silent
from hil.printable import printable

Dbc = Annotated[
    Path | None,
    typer.Option("--dbc", metavar="FILE", help="DBC file: what the frames of a logged CAN bus (MDF) mean."),
]


def tell(line: str) -> None:
    """Tell what was recognised in a file or done to it, on standard error."""
    if not is_silent():
        say(f"note: {printable(line)}", err=True)
