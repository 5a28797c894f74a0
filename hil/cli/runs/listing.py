"""``hil runs``: the runs of a folder, oldest first."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli.runs.columns import print_columns
from hil.cli.runs.opened import opened
from hil.cli.runs.options import HERE, AsJson, Folder

if TYPE_CHECKING:
    from hil.store import Run


def listed(
    context: typer.Context,
    experiment: Annotated[str, typer.Option(help="Only runs of this experiment.")] = "",
    since: Annotated[str, typer.Option(metavar="DATE", help="Started on that day (UTC) or later: 2026-11-21.")] = "",
    until: Annotated[str, typer.Option(metavar="DATE", help="Started on that day (UTC) or earlier.")] = "",
    rig: Annotated[str, typer.Option(help="Name of the rig, or the beginning of its file's SHA-256.")] = "",
    verdict: Annotated[str, typer.Option(help="explained, partly_explained, unexplained or no_mismatch.")] = "",
    text: Annotated[str, typer.Option(help="In notes, rig file, results, names.")] = "",
    store: Folder = HERE,
    as_json: AsJson = False,
) -> None:
    """List the runs of a folder, oldest first; all filters must hold."""
    if context.invoked_subcommand is not None:
        return
    from hil.store import RunFilter
    from hil.store.facts import SCHEMA, facts_of

    for option, date in (("--since", since), ("--until", until)):
        _require_date(option, date)
    with opened(store) as runs:
        found = runs.find(
            RunFilter(experiment=experiment, since=since, until=until, rig=rig, verdict=verdict, text=text)
        )
    if as_json:
        typer.echo(json.dumps({"schema": SCHEMA, "runs": [facts_of(run) for run in found]}))
    elif found:
        _print_table(found)
    else:
        typer.echo("no such run" if any((experiment, since, until, rig, verdict, text)) else "no runs yet")


def _require_date(option: str, date: str) -> None:
    from datetime import datetime

    from hil.errors import UsageError

    if not date:
        return
    try:
        datetime.fromisoformat(date)
    except ValueError as error:
        raise UsageError(f"{option}: expected a date such as 2026-11-21, got {date!r}") from error


def _print_table(runs: Sequence[Run]) -> None:
    """Print a line for each run; the rig only where there is more than one, for 80 columns are few."""
    from hil.store.entry import COMPLETE

    heads = (
        "run",
        "started (UTC)",
        "experiment",
        "length",
        "flagged",
        "ended",
        "verdict",
        "alarms",
        "recording",
        "rig",
    )
    rows = [
        (
            str(run.run_id),
            run.entry.started_utc[:16].replace("T", "\u00a0"),  # a blank that does not break the line
            run.entry.experiment,
            f"{run.entry.duration_s:.0f}\u00a0s",
            str(run.entry.flagged or ""),
            "" if run.entry.outcome == COMPLETE else _first_sentence(run.entry.outcome),
            run.verdict,
            str(run.alarms or ""),
            run.entry.recording.name,
            run.entry.rig_name,
        )
        for run in runs
    ]
    many_rigs = len({run.entry.rig_name for run in runs}) > 1
    shown = [k for k in range(len(heads)) if any(row[k] for row in rows) and (heads[k] != "rig" or many_rigs)]
    print_columns([heads[k] for k in shown], [[row[k] for k in shown] for row in rows])


def _first_sentence(text: str) -> str:
    """Return what ended a run, without what to do then: 'hil runs show' has it all."""
    return text.split(". ", 1)[0].rstrip(".")
