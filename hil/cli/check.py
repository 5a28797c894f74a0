"""``hil check``: whether every device is there and is the one the rig file describes, and whether an EDS is sound."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hil.cli.options import TakeOver
from hil.cli.printing import new_console, say
from hil.errors import InputError, UsageError

if TYPE_CHECKING:
    from rich.table import Table

    from drivers.eds_check import EdsReport
    from drivers.plc.named_registers import Reading
    from hil.config.rig_file import Rig
    from hil.rig.check import ChannelReading, DeviceFinding

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil check examples/rig.toml; hil check --eds examples/other_drive.eds")
def check(
    rig: Annotated[Path | None, typer.Argument(metavar="RIG", help="Rig file.")] = None,
    eds: Annotated[
        list[Path] | None, typer.Option("--eds", metavar="FILE", help="EDS to check by itself; may be repeated.")
    ] = None,
    prove_stop: Annotated[
        bool,
        typer.Option(
            "--prove-stop",
            help="Stop heartbeat and RPDOs of drives that agree, and see that they stop; count their dead time. "
            "Configures them and leaves them disabled; no torque is commanded. Not while another program drives them.",
        ),
    ] = False,
    proof: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Keep what --prove-stop saw: JSON with date, rig file and command."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    bus: Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")] = None,
    modbus: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")] = None,
    take_over: TakeOver = False,
) -> None:
    """Find both inverters and the PLC and compare them with rig file, EDS and register map.

    Only reads, except with --prove-stop: nothing is armed, no torque is commanded. Exit status 3 if a device is
    missing or differs.

    With --eds, check such a file line by line against CiA 306 and against what this program needs of a drive:
    exit status 2 if it can't be used. Without RIG no device is accessed.
    """
    from drivers.eds_check import check_eds
    from hil.config.rig_file import read_rig
    from hil.rig.check import check_rig
    from hil.simulator.addresses import with_addresses

    if rig is None and not eds:
        raise UsageError("expected a rig file, an EDS with --eds, or both, got neither. See: hil check --help")
    if rig is None and (bus or modbus or prove_stop):
        raise UsageError("--bus, --modbus and --prove-stop concern the rig's devices: expected a rig file next to them")
    if proof is not None:
        _require_proof(proof, prove_stop)
    rig_file = None if rig is None else with_addresses(read_rig(rig), bus, modbus, take_over)
    reports = tuple(check_eds(path) for path in eds or ())
    findings = () if rig_file is None or not all(each.usable for each in reports) else check_rig(rig_file, prove_stop)
    if proof is not None and rig is not None:
        _keep(proof, _document(rig_file, findings, reports), rig)
    if as_json:
        say(json.dumps(_document(rig_file, findings, reports), indent=2))
    else:
        _print_eds(reports)
        if rig_file is not None and findings:
            _print(rig_file.name, findings)
    _refuse(reports, rig_file, findings)


def _require_proof(proof: Path, prove_stop: bool) -> None:
    """Refuse a file that can't be written, before drives are touched."""
    from hil.result_folder import require_folder

    if not prove_stop:
        raise UsageError(f"--out {proof}: expected --prove-stop, whose proof it keeps. Give both or neither.")
    require_folder(proof.parent)


def _keep(proof: Path, document: dict[str, Any], rig: Path) -> None:
    """Write what was seen, with what made it: a proof that is not kept is none."""
    from hil.provenance import provenance
    from hil.result_folder import publish

    text = json.dumps({**document, "made": provenance([rig]).document()}, indent=2) + "\n"
    publish(proof.parent, {proof.name: lambda path: path.write_text(text, encoding="utf-8")})
    say(f"proof: {proof}", err=True)


def _refuse(reports: tuple[EdsReport, ...], rig: Rig | None, findings: tuple[DeviceFinding, ...]) -> None:
    from drivers.errors import ConfigMismatch
    from hil.report.eds_findings import verdict
    from hil.rig.check import DeviceVerdict

    if unusable := [each for each in reports if not each.usable]:
        raise InputError(
            f"{'; '.join(f'EDS {each.path} is {verdict(each)}' for each in unusable)}: see above. "
            "Fix a copy of the file, or take the one of the drive's firmware version."
        )
    bad = [finding.device for finding in findings if finding.verdict is not DeviceVerdict.AGREES]
    if rig is not None and bad:
        raise ConfigMismatch(
            f"rig {rig.name!r}: {', '.join(bad)}: expected all there and as described, see above. "
            "Correct the rig file, or fix or connect the device it describes."
        )


def _print_eds(reports: tuple[EdsReport, ...]) -> None:
    from hil.report.eds_findings import eds_lines

    for report in reports:
        for line in eds_lines(report):
            say(line)


def _print(name: str, findings: tuple[DeviceFinding, ...]) -> None:
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=name, title_justify="left")
    for column in ("device", "address", "result", "what", "expected", "found"):
        table.add_column(column, overflow="fold")
    for finding in findings:
        rows = [(each.what, f"{each.expected} ({each.source})", each.found) for each in finding.differences]
        for row in rows or [("", "", "")]:
            table.add_row(*map(escape, (finding.device, finding.address, finding.verdict.value, *row)))
    console = new_console()
    console.print(table)
    for finding in findings:
        if finding.registers:
            console.print(_register_table(finding))
    if any(finding.channels for finding in findings):
        console.print(_channel_table(findings))
    for finding in findings:
        for line in (*finding.notes, *_details(finding)):
            console.print(f"{finding.device}: {line}", markup=False, highlight=False, soft_wrap=True)


def _details(finding: DeviceFinding) -> Iterator[str]:
    """Say what is no difference: what a run sets, where the DCF is of another mind, what stops a dead host's torque."""
    yield from finding.questions
    yield from finding.remarks
    yield from (f"not the same everywhere: {each}" for each in finding.commissioned)
    yield from (f"if the host fails, {each}" for each in finding.protections)
    if finding.dead_cycles is not None:
        yield f"dead time: {finding.dead_cycles} cycles from a command to the answer that shows it"


def _register_table(finding: DeviceFinding) -> Table:
    """Lay out what each register holds, in its unit."""
    from rich.table import Table

    table = Table(title=f"registers of {finding.device}", title_justify="left")
    for column in ("register", "where", "value", "unit"):
        table.add_column(column, justify="right" if column == "value" else "left", overflow="fold")
    if any(each.problem is not None for each in finding.registers):
        table.add_column("result")
    for each in finding.registers:
        result = "" if each.problem is None else "not plausible" if each.value is not None else "not read"
        row = (each.name, f"{each.register.kind.value} {each.register.address}", each.shown, each.unit, result)
        table.add_row(*row[: len(table.columns)])
    return table


def _channel_table(findings: tuple[DeviceFinding, ...]) -> Table:
    """Lay out what each further channel reads."""
    from rich.table import Table

    table = Table(title="channels", title_justify="left")
    for column in ("column", "what", "source", "value", "unit"):
        table.add_column(column, justify="right" if column == "value" else "left", overflow="fold")
    for each in (each for finding in findings for each in finding.channels):
        channel = each.channel
        shown = "not read" if each.value is None else f"{each.value:.6g}"
        what = f"{channel.kind.value}, {channel.at.value}"
        table.add_row(channel.column, what, channel.source, shown, channel.unit)
    return table


def _document(rig: Rig | None, findings: tuple[DeviceFinding, ...], reports: tuple[EdsReport, ...]) -> dict[str, Any]:
    from hil.report.eds_findings import eds_section

    files = [eds_section(report) for report in reports]
    if rig is None or not findings:
        return {"schema": "hil.eds_check/1", "files": files}
    devices = [_device(finding) for finding in findings]
    return {"schema": "hil.check/1", "rig": rig.name, "devices": devices} | ({"eds": files} if files else {})


def _device(finding: DeviceFinding) -> dict[str, Any]:
    return {
        "name": finding.device,
        "address": finding.address,
        "result": finding.verdict.value,
        "differences": [
            {"what": each.what, "expected": each.expected, "found": each.found, "source": each.source}
            for each in finding.differences
        ],
        "notes": list(finding.notes),
        "remarks": list(finding.remarks),
        **({"questions": list(finding.questions)} if finding.questions else {}),
        "commissioned": [asdict(each) for each in finding.commissioned],
        "protections": [asdict(each) for each in finding.protections],
        **({} if finding.dead_cycles is None else {"dead_cycles": finding.dead_cycles}),
        **({"registers": [_register(each) for each in finding.registers]} if finding.registers else {}),
        **({"channels": [_channel(each) for each in finding.channels]} if finding.channels else {}),
    }


def _channel(reading: ChannelReading) -> dict[str, Any]:
    channel = reading.channel
    return {
        "column": channel.column,
        "kind": channel.kind.value,
        "at": channel.at.value,
        "source": channel.source,
        "value": reading.value,
        "unit": channel.unit,
    }


def _register(reading: Reading) -> dict[str, Any]:
    return {
        "name": reading.name,
        "kind": reading.register.kind.value,
        "address": reading.register.address,
        "value": reading.value,
        "unit": reading.register.unit,
        "problem": reading.problem,
    }
