"""``hil check``: whether every device is there, and is the one the rig file describes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from drivers.errors import ConfigMismatch
from hil.config.rig_file import read_rig
from hil.rig.addresses import with_addresses
from hil.rig.check import Finding, Verdict, check_rig

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil check examples/rig.toml")
def check(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Rig file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    bus: Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")] = None,
    modbus: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")] = None,
) -> None:
    """Find both inverters and the PLC and compare them with rig file, EDS and register map.

    Reads only: nothing is armed, no torque is commanded. Exit status 3 if a device is missing or differs.
    """
    rig_file = with_addresses(read_rig(rig), bus, modbus)
    findings = check_rig(rig_file)
    if as_json:
        typer.echo(json.dumps(_document(rig_file.name, findings), indent=2))
    else:
        _print(rig_file.name, findings)
    if bad := [finding.device for finding in findings if finding.verdict is not Verdict.AGREES]:
        raise ConfigMismatch(
            f"rig {rig_file.name!r}: {', '.join(bad)}: expected all there and as described, see above. "
            "Correct the rig file, or mend or connect the device it describes."
        )


def _print(name: str, findings: tuple[Finding, ...]) -> None:
    table = Table(title=name, title_justify="left")
    for column in ("device", "address", "result", "what", "expected", "found"):
        table.add_column(column, overflow="fold")
    for finding in findings:
        rows = [(each.what, f"{each.expected} ({each.source})", each.found) for each in finding.differences]
        for row in rows or [("", "", "")]:
            table.add_row(*map(escape, (finding.device, finding.address, finding.verdict.value, *row)))
    console = Console()
    console.print(table)
    for finding in findings:
        for note in finding.notes:
            console.print(f"{finding.device}: {note}", markup=False, highlight=False)


def _document(name: str, findings: tuple[Finding, ...]) -> dict[str, Any]:
    return {"schema": "hil.check/1", "rig": name, "devices": [_device(finding) for finding in findings]}


def _device(finding: Finding) -> dict[str, Any]:
    return {
        "name": finding.device,
        "address": finding.address,
        "result": finding.verdict.value,
        "differences": [
            {"what": each.what, "expected": each.expected, "found": each.found, "source": each.source}
            for each in finding.differences
        ],
        "notes": list(finding.notes),
    }
