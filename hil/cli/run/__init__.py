"""``hil run``: one experiment, recorded; or, as a dry run, what it would do."""

from __future__ import annotations

import typer

from hil.cli.run.command import run

__all__ = ["app"]

app = typer.Typer(add_completion=False)
app.command(
    epilog="Example: hil run examples/rig.toml cruise --out cruise.csv. "
    "First look at it: hil run examples/rig.toml cruise --dry-run"
)(run)
