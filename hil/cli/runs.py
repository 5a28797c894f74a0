"""``hil runs``: what was run, with what, and what came of it."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hil.cli.printing import new_console, say
from hil.errors import StoreError, UsageError
from hil.printable import shown

if TYPE_CHECKING:
    from hil.store import Run, RunStore
    from hil.store.rebuild import Rebuilt


Folder = Annotated[Path, typer.Option("--store", metavar="DIR", help="Folder of the recordings.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
RunId = Annotated[int, typer.Argument(metavar="RUN", help="Number of the run, as 'hil runs' lists it.")]
HERE = Path()
"""The folder where none is given."""

LONGEST_VALUE = 100
"""Characters of a setting that stand on one line."""

HEAD = ("recording", "experiment", "started_utc", "duration_s", "samples", "flagged", "outcome", "verdict")
"""The facts that come first."""


def opened(folder: Path) -> RunStore:
    """Open the store of a folder; a look must not make one."""
    from hil.store import RunStore, store_of

    if not store_of(folder).exists():
        old = folder / "runs.sqlite"
        raise UsageError(
            f"{store_of(folder)}: expected a list of runs, there is none. 'hil run' makes one next to its recording, "
            f"'hil runs rebuild --store {folder}' makes one of the recordings there."
            + (f" {old} of an earlier version is not read: its notes stay in it." if old.exists() else "")
        )
    return RunStore(folder)


def cell(value: Any) -> str:
    """Write a value as it stands in a line or a cell; nothing where there is none."""
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def print_columns(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table."""
    from rich.table import Table
    from rich.text import Text

    table = Table(*heads, box=None, pad_edge=False)
    for row in rows:
        table.add_row(*(Text(shown(text)) for text in row))  # as it is: "[Hz]" is no markup
    terminal = new_console()
    terminal.print(table, soft_wrap=not terminal.is_terminal)


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
    from hil.store.entry import SCHEMA, run_facts

    for option, date in (("--since", since), ("--until", until)):
        _require_date(option, date)
    with opened(store) as runs:
        found = runs.find(
            RunFilter(experiment=experiment, since=since, until=until, rig=rig, verdict=verdict, text=text)
        )
    if as_json:
        say(json.dumps({"schema": SCHEMA, "runs": [run_facts(run) for run in found]}))
    elif found:
        _print_table(found)
    else:
        say("no such run" if any((experiment, since, until, rig, verdict, text)) else "no runs yet")


def _require_date(option: str, date: str) -> None:
    from datetime import datetime

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


def show(run: RunId, store: Folder = HERE, as_json: AsJson = False) -> None:
    """Show everything about one run, and whether its recording has changed."""
    from hil.store.entry import alarms_of, results_of, run_facts
    from hil.store.run_files import recording_state

    with opened(store) as runs:
        found = runs.get(run)
    state, facts, results = recording_state(found.entry), run_facts(found), results_of(found)
    if as_json:
        shown = {"recording_state": state, "results": results, "alarm_statements": alarms_of(found)}
        more = {**shown, "rig_file": found.entry.rig_text}
        say(json.dumps({"schema": "hil.run_facts/1", **facts, **more}))
        return
    for what in HEAD:
        _line(what, facts[what])
    _line("recording is", state)
    _line("data_sha256", facts["data_sha256"])
    _line("rig", f"{facts['rig'] or '(unnamed)'}, SHA-256 {facts['rig_sha256'] or '(none)'}")
    for inverter, sha256 in found.entry.eds_sha256.items():
        _line(f"EDS of {inverter}", f"SHA-256 {sha256}")
    _line("software", facts["software_version"])
    for what, value in results.items():
        _line(what, value)
    for statement in alarms_of(found):
        _line("ALARM", statement)
    for note in found.notes:
        _line(f"note {note.written_utc}", note.text)
    for attachment in found.attachments:
        _line(f"{attachment.kind} {attachment.added_utc}", attachment.path or "(no file)")
    for what, value in found.entry.settings.items():
        _line(what, value if len(value) <= LONGEST_VALUE else f"{len(value)} characters; --json has them")


def _line(what: str, value: Any) -> None:
    say(f"{what:<31} {cell(value)}")


def compare(
    a: RunId,
    b: Annotated[int, typer.Argument(metavar="RUN", help="The other.")],
    every: Annotated[bool, typer.Option("--all", help="Also what they have in common.")] = False,
    store: Folder = HERE,
    as_json: AsJson = False,
) -> None:
    """Compare two runs: facts, results, and the lines in which their rig files differ."""
    from hil.store.entry import compare_runs

    with opened(store) as runs:
        both = compare_runs(runs.get(a), runs.get(b))
    if as_json:
        rows = [{"what": row.what, "a": row.a, "b": row.b, "differs": row.differs} for row in both.rows]
        document = {"schema": "hil.runs_compare/1", "a": a, "b": b, "rows": rows, "rig_changes": both.rig_changes}
        say(json.dumps(document))
        return
    shown = [row for row in both.rows if every or row.differs]
    cells = [(row.what, *(_short(row.what, value) for value in (row.a, row.b))) for row in shown]
    print_columns(("", f"run {a}", f"run {b}"), cells)
    for line in both.rig_changes:
        say(line)


def _short(what: str, value: Any) -> str:
    """Shorten a checksum to what distinguishes any two."""
    return f"{value[:16]}…" if value and ("sha256" in what or what.startswith("EDS")) else cell(value)


def note(
    run: RunId,
    text: Annotated[str, typer.Argument(metavar="TEXT", help="Text of the note.")],
    store: Folder = HERE,
) -> None:
    """Write a note to a run."""
    with opened(store) as runs:
        runs.note(run, text)
    say(f"note written to run {run}")


def attach(
    run: RunId,
    kind: Annotated[str, typer.Argument(metavar="KIND", help="diagnosis, identification, model, or your own word.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Result of the run.")],
    store: Folder = HERE,
) -> None:
    """Attach a result to a run; its text is kept as it is now."""
    with opened(store) as runs:
        runs.attach(run, kind, file)
    say(f"{file} attached to run {run} as {kind}")


def delete(
    run: RunId,
    with_recording: Annotated[bool, typer.Option("--with-recording", help="The recording's file too.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Don't ask; for scripts.")] = False,
    store: Folder = HERE,
) -> None:
    """Delete a run from the store, after asking; its recording stays, except with --with-recording.

    While the recording exists, 'hil runs rebuild' enters it again.
    """
    from hil.store.run_files import remove_files, require_own

    with opened(store) as runs:
        found = runs.get(run)
        if with_recording:
            require_own(found.entry)
        what = f"run {run}, {found.entry.experiment} of {found.entry.started_utc}"
        _confirm(f"delete {what}{f', and {found.entry.recording}' if with_recording else ''}?", yes)
        runs.delete(run)
    removed = remove_files(found.entry) if with_recording else []
    say(f"deleted {what}")
    for path in removed:
        say(f"deleted {path}")


def _confirm(question: str, yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        raise UsageError(f"{question} Expected --yes, for nobody can be asked here. Nothing was deleted.")
    if not typer.confirm(question):
        raise UsageError("Not confirmed. Nothing was deleted.")


def export(
    runs: Annotated[list[int] | None, typer.Argument(metavar="[RUN]...", help="Which; all without any.")] = None,
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="New file: .csv or .json (a table), .zip (recordings and all).")
    ] = ...,  # type: ignore[assignment]
    store: Folder = HERE,
) -> None:
    """Write runs into one file: a table, or recordings with rig files, notes and results."""
    from hil.store.run_files import export_runs

    with opened(store) as at_hand:
        chosen = [at_hand.get(run) for run in runs or [run.run_id for run in at_hand.find()]]
    export_runs(chosen, out)
    say(f"{out}: {len(chosen)} run{'' if len(chosen) == 1 else 's'}")


def rebuild(store: Folder = HERE, as_json: AsJson = False) -> None:
    """Update the list from the folder: enter recordings, find moved ones."""
    from hil.store import store_of
    from hil.store.rebuild import rebuild as rebuilt

    if not store.is_dir():
        raise StoreError(store_of(store), f"expected an existing folder, got {store}")
    result = rebuilt(store)
    for problem in result.unreadable:
        say(f"not entered: {problem}", err=True)
    if as_json:
        say(json.dumps(_document(result)))
        return
    for path in result.removed:
        say(f"removed {path}, unfinished by a process that was killed")
    say(f"{store_of(store)}: {_rebuilt_text(result)}")


def _document(result: Rebuilt) -> dict[str, Any]:
    return {
        "schema": "hil.runs_rebuild/1",
        "kept": result.before,
        "entered": result.found,
        "moved": result.moved,
        "copies": result.copies,
        "attached": result.attached,
        "unreadable": result.unreadable,
        "lost_notes": [],
        "damaged": None,
        "removed": [str(path) for path in result.removed],
    }


def _rebuilt_text(result: Rebuilt) -> str:
    counts = (
        (result.before, "runs kept"),
        (result.found, "entered"),
        (result.moved, "found again"),
        (result.copies, "copies left out"),
        (result.attached, "results attached"),
        (len(result.unreadable), "recordings unreadable"),
    )
    return ", ".join(f"{count} {what}" for count, what in counts if count) or "nothing to enter"


__all__ = ["app"]

app = typer.Typer(
    add_completion=False,
    epilog="Example: hil runs --experiment cruise --since 2026-11-01. One of them: hil runs show 3",
)
app.callback(invoke_without_command=True)(listed)
app.command(epilog="Example: hil runs show 3")(show)
app.command(epilog="Example: hil runs compare 3 7")(compare)
app.command(epilog='Example: hil runs note 3 "Wind from the left, second gear"')(note)
app.command(epilog="Example: hil runs attach 3 diagnosis out/diagnosis.json")(attach)
app.command(epilog="Example: hil runs delete 3 --with-recording")(delete)
app.command(epilog="Example: hil runs export 3 7 --out for_the_office.zip")(export)
app.command(epilog="Example: hil runs rebuild --store recordings")(rebuild)
