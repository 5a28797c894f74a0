"""``hil look``: what is in a recording, and the ``[signals]`` table that reads it."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hil.cli.options import Dbc, tell
from hil.cli.printing import new_console, say
from hil.errors import RecordingError
from hil.printable import printable

if TYPE_CHECKING:
    from hil.recording.look import Look
    from hil.recording.survey import Group

app = typer.Typer(add_completion=False)


@app.command(epilog="Example: hil look drive.mf4. A logged bus: hil look canedge.mf4 --dbc vehicle.dbc")
def look(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A recording of any format, or an FMU.")],
    dbc: Dbc = None,
    model: Annotated[
        Path | None,
        typer.Option("--model", metavar="MODEL", help="Model file to read FILE by: shows which scale is wrong."),
    ] = None,
    plot: Annotated[
        bool,
        typer.Option("--plot", help="Write FILE's name with .look.html: its channels over time, to see and to cut."),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Show what is in a recording: channels, units, rates, gaps, what each could be, and the table that reads it.

    Of an FMU, its variables and the options --map that name them; nothing of it runs.
    """
    from hil.plants.fmu_plant import is_fmu
    from hil.printable import printable
    from hil.recording.look import look as look_into

    if is_fmu(file):
        _look_into_fmu(file, as_json)
        return
    found = look_into(file, dbc)
    if plot:
        _plot(found, model, dbc)
    if as_json:
        say(json.dumps(_document(found)))
        return
    say(f"{file}: {_size(found)}")
    for line in found.survey.said:
        say(f"  {printable(line)}")
    _show(found)
    say("")
    if not found.signals:
        say("It has the columns that every command reads: no [signals] table is needed.")
    for line in found.signals:
        say(line)
    if model is not None:
        _tell_doubts(file, model, dbc)
    elif found.roles.torques and found.roles.output is not None:
        _tell_doubts_alone(found, dbc)


def _look_into_fmu(file: Path, as_json: bool) -> None:
    """Print an FMU's variables, and what of them is meant by ``--map`` most probably."""
    from rich.table import Table

    from hil.cli.printing import new_console
    from hil.plants.fmu_look import look_into

    found = look_into(file)
    if as_json:
        document = {"schema": "hil.look/1", "input": str(file), "variables": found.variables}
        say(json.dumps({**document, "map": found.mapped, "doubtful": found.doubtful}))
        return
    table = Table(box=None, pad_edge=False)
    headings = ("name", "causality", "variability", "type", "unit")
    for heading in headings:
        table.add_column(heading, overflow="fold")
    for each in found.variables:
        table.add_row(*(_plain(str(each[heading])) for heading in headings))
    new_console().print(table)
    say("")
    say(found.options or "No variable looks like a torque or a speed: name them by --map torque=... --map output=...")
    for key, others in found.doubtful.items():
        if others:
            say(f"{key} could as well be {', '.join(others)}")


def _plot(found: Look, model: Path | None, dbc: Path | None) -> None:
    """Write the page with the channels into this folder, and open it where a person sits at a terminal."""
    import webbrowser

    from hil.config.model_file import read_model_for_recordings, signals_of
    from hil.recording.signals_config import SignalsConfig
    from hil.report.look_page import look_page
    from hil.result_folder import publish

    known = None if model is None else read_model_for_recordings(model).signals
    if known is None and found.signals:
        known = signals_of("\n".join(found.signals))
    signals = known or SignalsConfig()
    text = look_page(found, signals, signals.request(dbc))
    page = Path(f"{found.path.stem}.look.html")
    publish(Path(), {page.name: lambda path: path.write_text(text, encoding="utf-8")})
    say(f"page: {page}", err=True)
    if sys.stdout.isatty():
        webbrowser.open(page.absolute().as_uri())


def _tell_doubts(file: Path, model: Path, dbc: Path | None) -> None:
    """Read a recording by a model file and tell what is doubtful of both, with the line that cures it."""
    from hil.config.model_file import read_model_for_recordings
    from hil.plants.scales import tell_doubts
    from hil.recording import read_record

    known = read_model_for_recordings(model)
    record = read_record(file, known.signals, known.on_bench, dbc, tell)
    tell_doubts([record], [file], known.model, known.signals, dbc, tell)


def _tell_doubts_alone(found: Look, dbc: Path | None) -> None:
    """Read a recording by the lines that were found and tell what of it is doubtful, with the line that cures it."""
    from hil.config.model_file import signals_of
    from hil.plants.scales import tell_doubts
    from hil.recording import read_record

    signals = signals_of("\n".join(found.signals)) if found.signals else None
    try:
        record = read_record(found.path, signals, dbc=dbc, tell=tell)
    except RecordingError as error:
        tell(f"by these lines the file can't be read yet: {error}")
        return
    tell_doubts([record], [found.path], None, signals, dbc, tell)


def _size(found: Look) -> str:
    groups = found.survey.groups
    count = sum(len(group.channels) for group in groups)
    times = "" if len(groups) == 1 else f", {len(groups)} times"
    return f"{count} channels{times}"


def _show(found: Look) -> None:
    """Print a table of the channels for each time."""
    from rich.table import Table

    from hil.recording.look import CHANNEL_HEADINGS, channel_rows

    console = new_console()
    for group in found.survey.groups:
        table = Table(title=_rate(group), title_justify="left", box=None, pad_edge=False)
        for heading in CHANNEL_HEADINGS:
            is_number = heading in ("samples", "missing", "low", "high")
            table.add_column(heading, justify="right" if is_number else "left", overflow="fold")
        for name, unit, rows, missing, *ends, could in channel_rows(group):
            low, high = ("" if value is None else f"{value:.6g}" for value in ends)
            table.add_row(*map(_plain, (name, unit, str(rows), str(missing or ""), low, high, could)))
        console.print(table)


def _plain(text: str) -> str:
    """Return a text that steers no terminal, and whose brackets are no markup."""
    from rich.markup import escape

    return escape(printable(text))


def _rate(group: Group) -> str:
    if group.rows < 2:
        return "\none row: no period"
    if group.period_s is None:
        return "\nno channel is a time"
    gaps = f", {group.gaps} gaps" if group.gaps else ""
    return f"\nevery {group.period_s:.4g} s{'' if group.even else ', uneven'}{gaps}"


def _document(found: Look) -> dict[str, Any]:
    chosen = found.roles
    return {
        "schema": "hil.look/1",
        "input": str(found.path),
        **found.survey.as_document(),
        "torque": [guess.channel.name for guess in chosen.torques],
        "output": None
        if chosen.output is None
        else {"kind": chosen.output.role.value, "column": chosen.output.channel.name},
        "signals": "\n".join(found.signals),
    }
