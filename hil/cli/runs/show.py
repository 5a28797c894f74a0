"""``hil runs show``: everything about one run."""

from __future__ import annotations

import json
from typing import Any

import typer

from hil.cli.runs.columns import cell
from hil.cli.runs.opened import opened
from hil.cli.runs.options import HERE, AsJson, Folder, RunId

LONGEST_VALUE = 100
"""Characters of a setting that stand on one line."""

HEAD = ("recording", "experiment", "started_utc", "duration_s", "samples", "flagged", "outcome", "verdict")
"""The facts that come first."""


def show(run: RunId, store: Folder = HERE, as_json: AsJson = False) -> None:
    """Show everything about one run, and whether its recording has changed."""
    from hil.store.facts import alarms_of, facts_of, results_of
    from hil.store.recording_state import recording_state

    with opened(store) as runs:
        found = runs.get(run)
    state, facts, results = recording_state(found.entry), facts_of(found), results_of(found)
    if as_json:
        shown = {"recording_state": state, "results": results, "alarm_statements": alarms_of(found)}
        more = {**shown, "rig_file": found.entry.rig_text}
        typer.echo(json.dumps({"schema": "hil.run_facts/1", **facts, **more}))
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
    typer.echo(f"{what:<31} {cell(value)}")
