"""``hil run``: one experiment, recorded; or, as a dry run, what it would do."""

from __future__ import annotations

import json
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from hil.cli.run_progress import RunProgress
from hil.config.rig_file import Rig, read_rig
from hil.errors import UsageError
from hil.recording.writer import RecordingWriter
from hil.rig.addresses import with_addresses
from hil.rig.build import open_devices
from hil.rig.drive import RunSummary
from hil.rig.metadata import run_metadata
from hil.rig.pacing import FreePacer, Pacer, RealTimePacer, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest, stop_on_signals
from hil.simulator.loopback import bus_address
from hil.simulator.rig_server import IN_PROCESS, required_simulation

app = typer.Typer(add_completion=False)


class Pace(Enum):
    """What the cycles are paced by."""

    REAL = "real"
    FAST = "fast"


@app.command(
    epilog="Example: hil run examples/rig.toml cruise --out cruise.csv. "
    "First look at it: hil run examples/rig.toml cruise --dry-run"
)
def run(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Rig file.")],
    experiment: Annotated[str, typer.Argument(metavar="EXPERIMENT", help="Name of an experiment of the rig file.")],
    out: Annotated[
        Path | None, typer.Option(metavar="REC", help="Recording to write, .csv or .parquet; a new file.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Predict torque and speed; opens no bus, writes nothing.")
    ] = False,
    pace: Annotated[Pace, typer.Option(help="By the wall clock, or as fast as a simulated rig answers.")] = Pace.REAL,
    bus: Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")] = None,
    modbus: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Run one experiment and record its measured part.

    The drives are at zero torque and disarmed on every way out, Ctrl-C included; the recording then holds
    everything up to there.
    """
    rig_file = with_addresses(read_rig(rig), bus, modbus)
    if dry_run:
        _predict(rig_file, experiment, as_json)
        return
    if out is None:
        raise UsageError("hil run: expected --out REC, a recording to write, or --dry-run; came neither.")
    summary = _record(rig_file, experiment, out, _pacer(rig_file, pace), run_metadata(rig, experiment))
    _report(summary, out, as_json)


def _record(rig: Rig, experiment: str, out: Path, pacer: Pacer, metadata: dict[str, str]) -> RunSummary:
    plan = plan_run(rig, experiment)
    stop = StopRequest()
    recorder = RecordingWriter(out, metadata)
    try:
        with stop_on_signals(stop), recorder, open_devices(rig) as devices, RunProgress(plan) as progress:
            return run_plan(devices, plan, pacer, recorder, stop, progress.show)
    except BaseException:
        if recorder.kept is not None:
            typer.echo(f"{recorder.kept} holds the {recorder.n_samples} samples up to there", err=True)
        raise


def _pacer(rig: Rig, pace: Pace) -> Pacer:
    if pace is Pace.REAL:
        return RealTimePacer(period_ns(rig.period_s))
    required_simulation(rig)
    if not rig.can.url.startswith(IN_PROCESS):
        bus_address(rig.can.url)  # a bus elsewhere may be a real one: SYNC would come at whatever rate it answers
    return FreePacer(period_ns(rig.period_s))


def _report(summary: RunSummary, out: Path, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps({"schema": "hil.run/1", "recording": str(out), **asdict(summary)}))
        return
    typer.echo(
        f"{out}: {summary.recorded} samples, {summary.flagged} flagged; "
        f"latest cycle {summary.most_late_ns / 1e6:.1f} ms late"
    )


def _predict(rig: Rig, experiment: str, as_json: bool) -> None:
    from hil.rig.dry_run import dry_run  # brings the driveline model along, which a run has no use for

    prediction = dry_run(rig, experiment)
    if as_json:
        typer.echo(json.dumps({"schema": "hil.dry_run/1", "experiment": experiment, **asdict(prediction)}))
        return
    rows = (
        ("base torque of both inverters", prediction.torque_nm, "Nm"),
        ("torque of m1, PRBS included", prediction.torque_m1_nm, "Nm"),
        ("torque of m2, PRBS included", prediction.torque_m2_nm, "Nm"),
        ("speed", prediction.speed_rad_s, "rad/s"),
        ("speed in the recorded part", prediction.speed_measured_rad_s, "rad/s"),
    )
    typer.echo(
        f"{experiment}: {prediction.cycles * prediction.period_s:.1f} s, "
        f"{prediction.measured * prediction.period_s:.1f} s of it recorded"
    )
    for what, values, unit in rows:
        typer.echo(f"  {what:32}{values.low:10.2f} to {values.high:8.2f} {unit}")
    typer.echo(f"  predicted with {prediction.vehicle.source}; the torque guard lets every cycle through")
