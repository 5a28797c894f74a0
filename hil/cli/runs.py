"""``hil runs``: what was run, with what, and what came of it."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from hil.store import Run, RunStore

app = typer.Typer(
    add_completion=False,
    epilog="Example: hil runs --experiment cruise --since 2026-11-01. One of them: hil runs show 3",
)

Folder = Annotated[Path, typer.Option("--store", metavar="DIR", help="Folder of the recordings and runs.sqlite.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
RunId = Annotated[int, typer.Argument(metavar="RUN", help="Number of the run, as 'hil runs' lists it.")]
Yes = Annotated[bool, typer.Option("--yes", help="Don't ask; for scripts.")]
HERE = Path()


@app.callback(invoke_without_command=True)
def listed(
    context: typer.Context,
    experiment: Annotated[str, typer.Option(help="Only runs of this experiment.")] = "",
    since: Annotated[str, typer.Option(metavar="DATE", help="Begun on that day (UTC) or later, 2026-11-21.")] = "",
    until: Annotated[str, typer.Option(metavar="DATE", help="Begun on that day (UTC) or earlier.")] = "",
    rig: Annotated[str, typer.Option(help="Name of the rig, or the beginning of its file's SHA-256.")] = "",
    verdict: Annotated[str, typer.Option(help="explained, unexplained or no_mismatch.")] = "",
    text: Annotated[str, typer.Option(help="In notes, rig file, results, names.")] = "",
    store: Folder = HERE,
    as_json: AsJson = False,
) -> None:
    """List the runs of a folder, oldest first; all that is asked for must hold."""
    if context.invoked_subcommand is not None:
        return
    from hil.store import RunFilter
    from hil.store.facts import SCHEMA, facts_of

    for option, date in (("--since", since), ("--until", until)):
        _require_date(option, date)
    with _opened(store) as runs:
        found = runs.find(
            RunFilter(experiment=experiment, since=since, until=until, rig=rig, verdict=verdict, text=text)
        )
    if as_json:
        typer.echo(json.dumps({"schema": SCHEMA, "runs": [facts_of(run) for run in found]}))
    elif found:
        _print_table(found)
    else:
        typer.echo("no such run" if any((experiment, since, until, rig, verdict, text)) else "no runs yet")


@app.command(epilog="Example: hil runs show 3")
def show(run: RunId, store: Folder = HERE, as_json: AsJson = False) -> None:
    """Show everything about one run, and whether its recording is still what it was."""
    from hil.store.facts import facts_of, results_of
    from hil.store.recording_state import recording_state

    with _opened(store) as runs:
        found = runs.get(run)
    state, facts, results = recording_state(found.entry), facts_of(found), results_of(found)
    if as_json:
        more = {"recording_state": state, "results": results, "rig_file": found.entry.rig_text}
        typer.echo(json.dumps({"schema": "hil.run_facts/1", **facts, **more}))
        return
    for what in ("recording", "experiment", "started_utc", "duration_s", "samples", "flagged", "outcome", "verdict"):
        _line(what, facts[what])
    _line("recording is", state)
    _line("data_sha256", facts["data_sha256"])
    _line("rig", f"{facts['rig'] or '(unnamed)'}, SHA-256 {facts['rig_sha256'] or '(none)'}")
    for inverter, sha256 in found.entry.eds_sha256.items():
        _line(f"EDS of {inverter}", f"SHA-256 {sha256}")
    _line("software", facts["software_version"])
    for what, value in results.items():
        _line(what, value)
    for note in found.notes:
        _line(f"note {note.written_utc}", note.text)
    for attachment in found.attachments:
        _line(f"{attachment.kind} {attachment.added_utc}", attachment.path or "(no file)")
    for what, value in found.entry.settings.items():
        _line(what, value if len(value) <= LONGEST_VALUE else f"{len(value)} characters; --json has them")


@app.command(epilog="Example: hil runs compare 3 7")
def compare(
    a: RunId,
    b: Annotated[int, typer.Argument(metavar="RUN", help="The other.")],
    every: Annotated[bool, typer.Option("--all", help="Also what they have in common.")] = False,
    store: Folder = HERE,
    as_json: AsJson = False,
) -> None:
    """Set two runs beside each other: facts, results, and the lines in which their rig files differ."""
    from hil.store.compare import compare_runs

    with _opened(store) as runs:
        both = compare_runs(runs.get(a), runs.get(b))
    if as_json:
        rows = [{"what": row.what, "a": row.a, "b": row.b, "differs": row.differs} for row in both.rows]
        document = {"schema": "hil.runs_compare/1", "a": a, "b": b, "rows": rows, "rig_changes": both.rig_changes}
        typer.echo(json.dumps(document))
        return
    rows_shown = [row for row in both.rows if every or row.differs]
    cells = [(row.what, *(_short(row.what, value) for value in (row.a, row.b))) for row in rows_shown]
    _print_columns(("", f"run {a}", f"run {b}"), cells)
    for line in both.rig_changes:
        typer.echo(line)


@app.command(epilog='Example: hil runs note 3 "Wind from the left, second gear"')
def note(
    run: RunId,
    text: Annotated[str, typer.Argument(metavar="TEXT", help="What is to be remembered of it.")],
    store: Folder = HERE,
) -> None:
    """Write a note to a run."""
    with _opened(store) as runs:
        runs.note(run, text)
    typer.echo(f"note written to run {run}")


@app.command(epilog="Example: hil runs attach 3 diagnosis out/diagnosis.json")
def attach(
    run: RunId,
    kind: Annotated[str, typer.Argument(metavar="KIND", help="diagnosis, identification, model, or your own word.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What came of the run.")],
    store: Folder = HERE,
) -> None:
    """Attach a result to a run; its text is kept as it is now."""
    with _opened(store) as runs:
        runs.attach(run, kind, file)
    typer.echo(f"{file} attached to run {run} as {kind}")


@app.command(epilog="Example: hil runs delete 3 --with-recording")
def delete(
    run: RunId,
    with_recording: Annotated[bool, typer.Option("--with-recording", help="The recording's file too.")] = False,
    yes: Yes = False,
    store: Folder = HERE,
) -> None:
    """Take a run out of the store, after asking; its recording stays, unless that is asked for.

    As long as the recording is there, 'hil runs rebuild' enters it again.
    """
    from hil.store.remove import remove_files

    with _opened(store) as runs:
        found = runs.get(run)
        what = f"run {run}, {found.entry.experiment} of {found.entry.started_utc}"
        _confirm(f"delete {what}{f', and {found.entry.recording}' if with_recording else ''}?", yes)
        runs.delete(run)
    removed = remove_files(found.entry.recording) if with_recording else []
    typer.echo(f"deleted {what}")
    for path in removed:
        typer.echo(f"deleted {path}")


@app.command(epilog="Example: hil runs export 3 7 --out for_the_office.zip")
def export(
    runs: Annotated[list[int] | None, typer.Argument(metavar="[RUN]...", help="Which; all without any.")] = None,
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="New file: .csv or .json (a table), .zip (recordings and all).")
    ] = ...,  # type: ignore[assignment]
    store: Folder = HERE,
) -> None:
    """Write runs into one file: a table, or recordings with rig files, notes and results."""
    from hil.store.export import export_runs

    with _opened(store) as opened:
        chosen = [opened.get(run) for run in runs or [run.run_id for run in opened.find()]]
    export_runs(chosen, out)
    typer.echo(f"{out}: {len(chosen)} runs")


@app.command(epilog="Example: hil runs rebuild --store recordings")
def rebuild(store: Folder = HERE, as_json: AsJson = False) -> None:
    """Bring the store up to what is in the folder: enter recordings, find moved ones, mend a damaged store.

    What can still be read of a damaged store is kept, notes and results included; the damaged file is put aside.
    """
    from hil.errors import StoreError
    from hil.store.rebuild import rebuild as rebuilt
    from hil.store.run_store import store_of

    if not store.is_dir():
        raise StoreError(store_of(store), f"expected an existing folder, came {store}")
    result = rebuilt(store)
    for problem in result.unreadable:
        typer.echo(f"not entered: {problem}", err=True)
    for text in result.lost_notes:
        typer.echo(f"note to a run that is lost: {text}", err=True)
    if as_json:
        document = {
            "schema": "hil.runs_rebuild/1",
            "kept": result.before,
            "entered": result.found,
            "moved": result.moved,
            "copies": result.copies,
            "attached": result.attached,
            "unreadable": list(result.unreadable),
            "lost_notes": list(result.lost_notes),
            "damaged": None if result.damaged is None else str(result.damaged),
        }
        typer.echo(json.dumps(document))
        return
    if result.damaged is not None:
        typer.echo(f"the damaged store is kept as {result.damaged}; {result.before} runs could be read of it")
    counts = (
        (result.before, "runs kept"),
        (result.found, "entered"),
        (result.moved, "found under a new name"),
        (result.copies, "copies left out"),
        (result.attached, "results attached"),
        (len(result.unreadable), "recordings unreadable"),
    )
    said = ", ".join(f"{count} {what}" for count, what in counts if count) or "nothing to enter"
    typer.echo(f"{store_of(store)}: {said}")


LONGEST_VALUE = 100
"""Characters of a setting that stand on one line."""


def _opened(folder: Path) -> RunStore:
    """Open the store of a folder that has one; a look must not make one."""
    from hil.errors import UsageError
    from hil.store import RunStore, store_of

    if not store_of(folder).exists():
        raise UsageError(
            f"{store_of(folder)}: expected a store of runs, there is none. 'hil run' makes one beside its recording, "
            f"'hil runs rebuild --store {folder}' makes one of the recordings there."
        )
    return RunStore(folder)


def _require_date(option: str, date: str) -> None:
    from datetime import datetime

    from hil.errors import UsageError

    if not date:
        return
    try:
        datetime.fromisoformat(date)
    except ValueError as error:
        raise UsageError(f"{option}: expected a date such as 2026-11-21, came {date!r}") from error


def _confirm(question: str, yes: bool) -> None:
    from hil.errors import UsageError

    if yes:
        return
    if not sys.stdin.isatty():
        raise UsageError(f"{question} Expected --yes, for nobody can be asked here. Nothing was deleted.")
    if not typer.confirm(question):
        raise UsageError("Not confirmed. Nothing was deleted.")


def _print_table(runs: Sequence[Run]) -> None:
    """Print a line for each run; the rig only where there is more than one, for 80 columns are few."""
    from hil.store.entry import COMPLETE

    heads = ("run", "started (UTC)", "experiment", "length", "flagged", "ended", "verdict", "recording", "rig")
    rows = [
        (
            str(run.run_id),
            run.entry.started_utc[:16].replace("T", "\u00a0"),  # a blank that does not break the line
            run.entry.experiment,
            f"{run.entry.duration_s:.0f}\u00a0s",
            str(run.entry.flagged or ""),
            "" if run.entry.outcome == COMPLETE else run.entry.outcome,
            run.verdict,
            run.entry.recording.name,
            run.entry.rig_name,
        )
        for run in runs
    ]
    many_rigs = len({run.entry.rig_name for run in runs}) > 1
    shown = [k for k in range(len(heads)) if any(row[k] for row in rows) and (heads[k] != "rig" or many_rigs)]
    _print_columns([heads[k] for k in shown], [[row[k] for k in shown] for row in rows])


def _print_columns(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table that fits a terminal and is plain text in a pipe."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(*heads, box=None, pad_edge=False)
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))  # as it is: "[Hz]" is no markup
    console = Console()
    console.print(table, soft_wrap=not console.is_terminal)


def _line(what: str, value: Any) -> None:
    typer.echo(f"{what:<31} {_cell(value)}")


def _short(what: str, value: Any) -> str:
    """Shorten a checksum to what tells any two apart."""
    return f"{value[:16]}…" if value and ("sha256" in what or what.startswith("EDS")) else _cell(value)


def _cell(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
