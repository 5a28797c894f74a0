"""``hil runs compare``: two runs alongside each other."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from hil.cli.runs.columns import cell, print_columns
from hil.cli.runs.opened import opened
from hil.cli.runs.options import HERE, AsJson, Folder, RunId


def compare(
    a: RunId,
    b: Annotated[int, typer.Argument(metavar="RUN", help="The other.")],
    every: Annotated[bool, typer.Option("--all", help="Also what they have in common.")] = False,
    store: Folder = HERE,
    as_json: AsJson = False,
) -> None:
    """Compare two runs: facts, results, and the lines in which their rig files differ."""
    from hil.store.compare import compare_runs

    with opened(store) as runs:
        both = compare_runs(runs.get(a), runs.get(b))
    if as_json:
        rows = [{"what": row.what, "a": row.a, "b": row.b, "differs": row.differs} for row in both.rows]
        document = {"schema": "hil.runs_compare/1", "a": a, "b": b, "rows": rows, "rig_changes": both.rig_changes}
        typer.echo(json.dumps(document))
        return
    shown = [row for row in both.rows if every or row.differs]
    cells = [(row.what, *(_short(row.what, value) for value in (row.a, row.b))) for row in shown]
    print_columns(("", f"run {a}", f"run {b}"), cells)
    for line in both.rig_changes:
        typer.echo(line)


def _short(what: str, value: Any) -> str:
    """Shorten a checksum to what distinguishes any two."""
    return f"{value[:16]}…" if value and ("sha256" in what or what.startswith("EDS")) else cell(value)
