"""``hil runs export``: runs in one file, for someone else."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.runs.opened import opened
from hil.cli.runs.options import HERE, Folder


def export(
    runs: Annotated[list[int] | None, typer.Argument(metavar="[RUN]...", help="Which; all without any.")] = None,
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="New file: .csv or .json (a table), .zip (recordings and all).")
    ] = ...,  # type: ignore[assignment]
    store: Folder = HERE,
) -> None:
    """Write runs into one file: a table, or recordings with rig files, notes and results."""
    from hil.store.export import export_runs

    with opened(store) as at_hand:
        chosen = [at_hand.get(run) for run in runs or [run.run_id for run in at_hand.find()]]
    export_runs(chosen, out)
    typer.echo(f"{out}: {len(chosen)} run{'' if len(chosen) == 1 else 's'}")
