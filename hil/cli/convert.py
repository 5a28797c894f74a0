"""``hil convert``: a recording, or a bus trace, into another format."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from hil.cli.options import Dbc
from hil.cli.printing import say
from hil.errors import UsageError

if TYPE_CHECKING:
    from hil.recording.table import Table

app = typer.Typer(add_completion=False)


@app.command(
    epilog="Example: hil convert cruise.csv cruise.mf4. A bus trace: hil convert cruise.blf cruise.parquet "
    "--rig examples/rig.toml"
)
def convert(
    source: Path = typer.Argument(
        ...,
        metavar="IN",
        help="Recording (.csv, .txt, .tsv, .parquet, .mf4, .mdf, .dat, .h5, .mat) or bus trace (.log, .blf, .asc, "
        ".trc).",
    ),
    target: Path = typer.Argument(..., metavar="OUT", help="Recording to write: .csv, .parquet, .mf4, .h5 or .mat."),
    rig: Path | None = typer.Option(None, "--rig", metavar="RIG", help="Rig file of the run; a bus trace needs it."),
    every: bool = typer.Option(False, "--all", help="Of a trace: every cycle, not only the measured part."),
    channel: str | None = typer.Option(None, metavar="NAME", help="Of a trace that has several channels: can0, 1."),
    force: bool = typer.Option(False, "--force", help="Replace OUT where it exists."),
    encoding: str = typer.Option("utf-8", metavar="NAME", help="Of a text IN, such as latin-1."),
    delimiter: str = typer.Option("", metavar="CHARACTER", help="Of a CSV IN, where its header does not tell it."),
    dbc: Dbc = None,
    as_json: bool = typer.Option(False, "--json", help="Print the result as JSON."),
) -> None:
    """Convert between the recording formats without loss, or say on standard error what is lost.

    OUT is read back and compared with IN, bit for bit, before it gets its name. Units, rig file, settings and the
    checksum of the data go along.
    """
    from hil.recording import write_table
    from hil.recording.formats import read_metadata
    from hil.recording.recordings import self_description
    from hil.rig.trace import is_trace

    _require_room(target, force)
    if is_trace(source):
        _refuse_for_trace(source, dbc)
        table = _trace(source, rig, every, channel)
    else:
        _refuse_for_recording(source, rig, every, channel)
        table = _recording(source, encoding, delimiter, dbc)
    lost: list[str] = []
    write_table(table, target, replace=force, on_loss=lost.extend)
    for line in (*(f"{source}: {remark}" for remark in table.remarks), *(f"{target}: lost: {what}" for what in lost)):
        say(line, err=True)
    if as_json:
        say(json.dumps(_document(source, target, table, lost)))
        return
    say(f"{target}: {table.n_rows} rows, {len(table.columns)} columns{', not all of it' if lost else ''}")
    for line in self_description(read_metadata(target)):  # what the recording says of itself
        say(f"  {line}")


def _require_room(target: Path, force: bool) -> None:
    """Refuse before anything is read; whatever else can be wrong with the name is reported by what writes."""
    if target.is_file() and not force:
        raise UsageError(f"{target}: expected a new name, got one that exists. Replace it with --force.")


def _refuse_for_recording(source: Path, rig: Path | None, every: bool, channel: str | None) -> None:
    if rig is not None or every or channel is not None:
        raise UsageError(
            f"{source}: expected a bus trace with --rig, --all or --channel, got a recording. Leave them out."
        )


def _refuse_for_trace(source: Path, dbc: Path | None) -> None:
    if dbc is not None:
        raise UsageError(
            f"{source}: expected --dbc with a recording of a logged bus (MDF), got a bus trace, whose frames the EDS "
            "files of --rig explain. Leave it out."
        )


def _recording(source: Path, encoding: str, delimiter: str, dbc: Path | None) -> Table:
    from pydantic import ValidationError

    from hil.recording import read_table
    from hil.recording.request import FormatHints, Request

    try:
        hints = FormatHints(encoding=encoding, delimiter=delimiter)
    except ValidationError as error:
        first = error.errors()[0]
        reason = str(first["msg"]).removeprefix("Value error, ")
        raise UsageError(f"--{first['loc'][0]}: expected {reason}, got {first['input']!r}") from error
    return read_table(source, Request(hints, dbc=dbc))


def _trace(source: Path, rig: Path | None, every: bool, channel: str | None) -> Table:
    from hil.config.rig_file import read_rig
    from hil.recording.writer import table_of
    from hil.rig.metadata import replay_metadata
    from hil.rig.replay import replay

    if rig is None:
        raise UsageError(
            f"{source}: expected --rig RIG besides a bus trace: its EDS files say which bits are torque and speed, "
            "got none."
        )
    described = read_rig(rig)
    samples = list(replay(source, described, whole=every, channel=channel))
    said = replay_metadata(rig, source, samples[0].t_ns if samples else 0)
    return table_of(samples, source, said, described.channel_units)


def _document(source: Path, target: Path, table: Table, lost: list[str]) -> dict[str, Any]:
    from hil.recording.formats import read_metadata
    from hil.recording.table import ColumnKind

    return {
        "schema": "hil.convert/1",
        "input": str(source),
        "output": str(target),
        "rows": table.n_rows,
        "columns": [
            {"name": name, "kind": ColumnKind.of(column).value, "unit": table.units.get(name)}
            for name, column in table.columns.items()
        ],
        "metadata": dict(read_metadata(target)),
        "remarks": list(table.remarks),
        "lost": lost,
    }
