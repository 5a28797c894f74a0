"""``hil monitor``: a rig or a recording, live, on a whole terminal."""

from __future__ import annotations

import os
import sys
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli.options import FilterOf, FilterRun, TakeOver, TrustLaws, with_filter
from hil.cli.printing import say
from hil.errors import RunAborted, UsageError

if TYPE_CHECKING:
    from hil.config.rig_file import Rig
    from hil.monitor.app import MonitorApp
    from hil.monitor.opening import Opening

app = typer.Typer(add_completion=False)


@app.command(
    epilog="Example: hil monitor examples/rig.toml --simulate. Of a recording, with nothing connected: "
    "hil monitor --replay cruise.parquet --speed 4"
)
def monitor(
    rig: Annotated[Path | None, typer.Argument(metavar="RIG", help="Rig file.")] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the recordings.")] = Path("runs"),
    model: Annotated[
        Path | None,
        typer.Option(metavar="MODEL", help="Two-mass model file for the twist; that of [simulation] otherwise."),
    ] = None,
    bus: Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")] = None,
    modbus: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")] = None,
    take_over: TakeOver = False,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Simulate the rig, with nothing connected; needs [simulation].")
    ] = False,
    replay: Annotated[
        Path | None,
        typer.Option(metavar="REC", help="Play a recording, or a bus trace of RIG; opens no rig."),
    ] = None,
    channel: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a bus trace with --replay that has several: can0, 1.")
    ] = None,
    filter_of: FilterOf = None,
    filter_run: FilterRun = None,
    trust_laws: TrustLaws = False,
    speed: Annotated[float, typer.Option(min=0.01, max=1000.0, help="Of --replay, in multiples of real time.")] = 1.0,
    page: Annotated[str, typer.Option(help="First page: overview, model, resonance, bus or log.")] = "overview",
    snapshot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the screen into this SVG file and end; needs no terminal.")
    ] = None,
    after: Annotated[float, typer.Option(metavar="SECONDS", min=0.1, help="When --snapshot is drawn.")] = 5.0,
    size: Annotated[str, typer.Option(metavar="COLSxROWS", help="Of the screen that --snapshot draws.")] = "80x24",
) -> None:
    """Watch a rig live: signals, on-line model, resonance and alarms, bus health; start, mark and stop experiments.

    Between experiments the drives stay disarmed. Every way out ends at zero torque with the drives disarmed.
    """
    screen = _size(size)
    if snapshot is None:
        _require_terminal()
    elif not snapshot.absolute().parent.is_dir():
        raise UsageError(f"--snapshot {snapshot}: expected an existing folder, there is no {snapshot.parent}")
    _require_page(page)
    say("hil monitor: starting", err=True)
    rig_file = _rig_file(rig, bus, modbus, take_over)
    opening = _open(rig, rig_file, replay, out, model, simulate, speed, channel, trust_laws, filter_of, filter_run)
    with opening.source:  # its process starts up while this one does
        view = _view(opening, out, page, None if snapshot is None else (snapshot, after))
        view.run(headless=snapshot is not None, size=None if snapshot is None else screen)
    _close(opening, view)


def _rig_file(rig: Path | None, bus: str | None, modbus: str | None, take_over: bool) -> Rig | None:
    from hil.config.rig_file import read_rig
    from hil.simulator.addresses import with_addresses

    return None if rig is None else with_addresses(read_rig(rig), bus, modbus, take_over)


def _open(
    rig: Path | None,
    rig_file: Rig | None,
    replay: Path | None,
    out: Path,
    model: Path | None,
    simulate: bool,
    speed: float,
    channel: str | None,
    trust_laws: bool,
    filter_of: Path | None,
    filter_run: str | None,
) -> Opening:
    from hil.monitor.opening import open_recording, open_rig
    from hil.rig.live import tracking_settings

    setup = with_filter(tracking_settings(), filter_of, filter_run)
    if replay is not None:
        if simulate:
            raise UsageError("hil monitor: expected --replay or --simulate, got both")
        opening = open_recording(replay, rig_file, speed, model, trust_laws, channel, setup)
    elif rig is None or rig_file is None:
        raise UsageError("hil monitor: expected RIG, a rig file to watch, or --replay REC; got neither")
    else:
        opening = open_rig(rig, rig_file, out, simulate, model, trust_laws, setup)
    return opening


def _view(opening: Opening, out: Path, page: str, picture: tuple[Path, float] | None) -> MonitorApp:
    from hil.monitor.app import MonitorApp

    return MonitorApp(opening.source, opening.state, opening.choices, str(out), page, picture)


def _close(opening: Opening, view: MonitorApp) -> None:
    """Say how every run went, then end as the view ended.

    Where the terminal has gone, which is reported as an interruption, nobody can be informed.
    """
    from hil.monitor.messages import outcome

    for report in opening.source.poll():  # what the rig said while it was being closed
        opening.state.take(report)
    if opening.source.can_drive:
        with suppress(OSError) if view.interrupted else nullcontext():
            for run in opening.state.runs:
                say(outcome(run))
    if opening.state.ended is not None and opening.state.ended.error is not None:
        raise RunAborted(opening.state.ended.error)
    if view.return_code:
        raise RuntimeError("the view ended by a defect of its own, reported above; the rig was ended as by q")
    if view.interrupted:
        raise KeyboardInterrupt


def _size(text: str) -> tuple[int, int]:
    columns, _, rows = text.partition("x")
    if not (columns.isdecimal() and rows.isdecimal() and int(columns) > 0 and int(rows) > 0):
        raise UsageError(f"--size {text!r}: expected COLSxROWS, for example 120x40")
    return int(columns), int(rows)


def _require_page(page: str) -> None:
    from hil.monitor.layout import PAGES

    if page not in PAGES:
        raise UsageError(f"--page {page!r}: expected one of {', '.join(PAGES)}")


def _require_terminal() -> None:
    """Refuse to draw where nobody can see it, or where it has no room."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise UsageError(
            "hil monitor: expected a terminal on standard input and output, got a pipe or a file. Over ssh ask for "
            "one with ssh -t; for a picture without one use --snapshot FILE; for scripts use hil run --json."
        )
    from hil.monitor.layout import LEAST_COLUMNS, LEAST_ROWS

    columns, rows = os.get_terminal_size(sys.stdout.fileno())
    if columns < LEAST_COLUMNS or rows < LEAST_ROWS:
        raise UsageError(
            f"hil monitor: expected a terminal of at least {LEAST_COLUMNS} x {LEAST_ROWS}, got {columns} x {rows}. "
            "Make it larger, or its type smaller."
        )
