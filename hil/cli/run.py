"""``hil run``: one experiment, recorded; or, as a dry run, what it would do."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli.completion import experiment_names
from hil.cli.options import FilterOf, FilterRun, Pace, PaceOption, TakeOver, TrustLaws, pacer_for, scheduling
from hil.errors import UsageError

app = typer.Typer(add_completion=False)


@app.command(
    epilog="Example: hil run examples/rig.toml cruise --out cruise.csv. "
    "First look at it: hil run examples/rig.toml cruise --dry-run"
)
def run(
    rig: Annotated[Path, typer.Argument(metavar="RIG", help="Rig file.")],
    experiment: Annotated[
        str,
        typer.Argument(
            metavar="EXPERIMENT",
            help="Name of an experiment of the rig file, or a TOML file with one, as hil design writes it.",
            autocompletion=experiment_names,
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="REC", help="Recording to write, .csv or .parquet; a new file.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Predict torque and speed; opens no bus, writes nothing.")
    ] = False,
    pace: PaceOption = Pace.REAL,
    bus: Annotated[str | None, typer.Option(metavar="URL", help="CAN bus in place of the rig file's.")] = None,
    modbus: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="PLC in place of the rig file's.")] = None,
    take_over: TakeOver = False,
    trace: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Bus trace next to it: every frame; .blf, .log (candump) or .asc; a new file."
        ),
    ] = None,
    estimate: Annotated[
        bool, typer.Option(help="Estimate while driving; its course goes next to the recording: .online.json.")
    ] = True,
    damper: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Active damping in the measured part, of hil design damper.")
    ] = None,
    filter_of: FilterOf = None,
    filter_run: FilterRun = None,
    trust_laws: TrustLaws = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Run one experiment, record its measured part, and follow the resonance while driving.

    The drives are at zero torque and disarmed on every way out, Ctrl-C included; the recording then holds
    everything up to there.
    """
    from hil.config.rig_file import with_experiment_of
    from hil.simulator.addresses import with_addresses

    named, rig_text, experiment = with_experiment_of(rig, experiment)
    rig_file = with_addresses(named, bus, modbus, take_over)
    if dry_run and damper is not None:
        raise UsageError("hil run: expected --damper or --dry-run, which predicts without it; got both.")
    if dry_run:
        from hil.cli.run_job import predict

        predict(rig_file, experiment, as_json, trust_laws)
        return
    if out is None:
        raise UsageError("hil run: expected --out REC, a recording to write, or --dry-run; got neither.")
    from hil.cli.run_job import RunJob, damping, live_estimate, print_result, record
    from hil.rig.metadata import run_metadata

    metadata = {**run_metadata(rig, experiment, rig_text), "pace": pace.value}
    live = live_estimate(rig_file, out, filter_of, filter_run) if estimate else None
    closed = None if damper is None else damping(damper, live)
    if damper is not None:
        metadata["damper"] = damper.name
    job = RunJob(rig_file, experiment, out, trace, pacer_for(rig_file, pace), metadata, live, closed)
    with scheduling(pace) as grants:
        summary = record(job, grants)
    print_result(job, summary, grants, as_json)
