"""The plan before, the result after, and the report: as lines, as JSON, as a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from hil.cli.printing import say
from hil.commission.engine import STEPS, plan_document
from hil.commission.state import State
from hil.commission.step import Job
from hil.commission.talk import plan_lines, result_document, result_lines
from hil.provenance import provenance
from hil.report.outputs import publish

if TYPE_CHECKING:
    from rich.console import Console

REPORT, MODEL = "commissioning.html", "model.toml"


def write_report(state: State) -> None:
    """Write the commissioning report into the folder of the job, and into the state what it was made from."""
    from hil.report.commission_html import commission_page  # brings the plotting library along

    runs = [run for record in state.steps.values() for run in record.runs if run.recording]
    recordings = [path for run in runs if (path := state.folder / str(run.recording)).is_file()]
    models = [path for path in (Path(state.rig_path), state.folder / MODEL) if path.is_file()]
    made = provenance(models, recordings)
    page = commission_page(state.document(), {step.name: step.title for step in STEPS}, made)
    publish(state.folder, {REPORT: lambda path: path.write_text(page, encoding="utf-8")})
    state.made = made.document()
    state.save()


def print_plan(job: Job, console: Console, as_json: bool) -> None:
    """Print what the job would do."""
    document = plan_document(job)
    if as_json:
        say(json.dumps(document))
        return
    for line in plan_lines(document):
        console.print(line, markup=False, soft_wrap=not console.is_terminal)


def print_result(state: State, console: Console, as_json: bool, reported: bool) -> None:
    """Print what has come of the job so far; ``reported`` tells whether its report could be written."""
    document = result_document(state.document(), str(state.folder), REPORT if reported else None)
    if as_json:
        say(json.dumps(document))
        return
    for line in result_lines(document):
        console.print(line, markup=False, soft_wrap=True)
