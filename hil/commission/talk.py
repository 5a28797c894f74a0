"""What a commissioning says: findings, plan and result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rich.table import Table
from rich.text import Text

from hil.commission.state import StepFinding

RESULT_SCHEMA = "hil.commission_result/1"

MARKS = MappingProxyType({True: ("within", "green"), False: ("OUTSIDE", "bold red"), None: ("–", "")})
"""What stands for within, outside, and no limit or not known; the word says it, not the colour."""


def findings_table(title: str, findings: Sequence[StepFinding]) -> Table:
    """Return the findings of a step as a table, and what to do where one is outside."""
    table = Table(title=title, title_justify="left", pad_edge=False, expand=False)
    for column in ("what", "expected", "measured", "within?"):
        table.add_column(column, overflow="fold")
    for finding in findings:
        word, style = MARKS[finding.within]
        verdict = word if finding.within is not None or finding.expected == "–" else "can't tell"
        row = (finding.what, finding.expected, finding.measured)
        table.add_row(*(Text(cell) for cell in row), Text(verdict, style=style))
        if finding.advice and finding.within is not True:
            table.add_row(Text(""), Text(f"→ {finding.advice}", style="italic"), Text(""), Text(""))
    return table


def plan_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Return the lines of a plan (schema ``hil.commission_plan/1``)."""
    yield f"{document['rig']}: the plan of its commissioning"
    for number, step in enumerate(document["steps"], start=1):
        settled = "" if step["status"] == "pending" else f" [{step['status']}]"
        yield ""
        yield f"{number:2} {step['title']} ({step['name']}){settled}"
        yield f"   {step['about']}"
        for run in step["runs"]:
            m1, m2, speed = (run[key] for key in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s"))
            yield (
                f"   {run['name']:10} {run['seconds']:6.1f} s  m1 {m1[0]:5.0f} to {m1[1]:4.0f} Nm  m2 {m2[0]:5.0f} to "
                f"{m2[1]:4.0f} Nm  speed {speed[0]:6.1f} to {speed[1]:5.1f} rad/s"
            )
    yield ""
    yield (
        f"vehicle time: {document['vehicle_s'] / 60.0:.0f} min, at most "
        f"{document['most_vehicle_s'] / 60.0:.0f} expected: driving as predicted, connecting, 30 s per question"
    )


def result_document(state: Mapping[str, Any], folder: str, report: str | None) -> dict[str, Any]:
    """Return the result for scripts (schema ``hil.commission_result/1``); ``report`` None where it is not written."""
    steps = state["steps"]
    settled = [record["status"] in ("done", "skipped") for record in steps.values()]
    findings = [finding for record in steps.values() for finding in record["findings"]]
    model = Path(folder) / "model.toml"
    return {
        "schema": RESULT_SCHEMA,
        "rig": state["rig_name"],
        "complete": all(settled),
        "outside": sum(finding["within"] is False for finding in findings),
        "driven_s": round(sum(run["seconds"] for record in steps.values() for run in record["runs"]), 1),
        "report": None if report is None else str(Path(folder) / report),
        "model": str(model) if model.exists() else None,
        "steps": {
            name: {key: record[key] for key in ("status", "because", "attempt", "findings")}
            for name, record in steps.items()
        },
        "made": state.get("made"),
    }


def result_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Return the lines of a result (schema ``hil.commission_result/1``)."""
    open_steps = [name for name, step in document["steps"].items() if step["status"] not in ("done", "skipped")]
    skipped = [name for name, step in document["steps"].items() if step["status"] == "skipped"]
    yield ""
    if open_steps:
        to_go = "1 step" if len(open_steps) == 1 else f"{len(open_steps)} steps"
        yield f"not complete: it continues with {open_steps[0]} at the next call, {to_go} to go"
    else:
        yield f"complete: {_outside(document['outside'])}, {document['driven_s'] / 60.0:.1f} min driven"
    if skipped:
        yield f"skipped: {', '.join(skipped)}"
    yield f"report: {document['report'] or 'not written'}"
    if document["model"]:
        yield f"model:  {document['model']}"


def _outside(count: int) -> str:
    return "1 finding outside its limits" if count == 1 else f"{count or 'no'} findings outside their limits"
