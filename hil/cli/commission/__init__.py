"""``hil commission``: the job step by step, from the first look for devices to model file and report."""

from __future__ import annotations

import typer

from hil.cli.commission.command import commission

__all__ = ["app"]

app = typer.Typer(add_completion=False)
app.command(
    epilog="Example: hil commission examples/rig.toml --out commissioning. "
    "First look at it: hil commission examples/rig.toml --out commissioning --dry-run"
)(commission)
