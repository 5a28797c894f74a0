"""``hil run``: one experiment, recorded; or, as a dry run, what it would do."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from drivers.canopen.can_link import CanLink
from hil.cli.run_progress import RunProgress
from hil.config.rig_file import Rig, read_rig
from hil.errors import UsageError
from hil.recording.writer import RecordingWriter
from hil.rig.addresses import with_addresses
from hil.rig.build import open_devices
from hil.rig.drive import RunSummary
from hil.rig.experiments.base import Phase
from hil.rig.metadata import run_metadata
from hil.rig.pacing import FreePacer, Pacer, RealTimePacer, period_ns
from hil.rig.plan import plan_run
from hil.rig.realtime import NOT_ASKED, RealTimeGrants, real_time
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest, stop_on_signals
from hil.rig.timing import RunTiming, timing_lines
from hil.rig.trace import BusTrace
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
    trace: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Bus trace beside it: every frame; .blf, .log (candump) or .asc; a new file."
        ),
    ] = None,
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
    metadata = {**run_metadata(rig, experiment), "pace": pace.value}
    job = _Job(rig_file, experiment, out, trace, _pacer(rig_file, pace), metadata)
    with real_time() if pace is Pace.REAL else nullcontext(NOT_ASKED) as grants:
        summary = _record(job, grants)
    _report(job, summary, grants, as_json)


@dataclass(frozen=True, slots=True)
class _Job:
    """One run as it was asked for."""

    rig: Rig
    experiment: str
    out: Path
    trace: Path | None
    pacer: Pacer
    metadata: dict[str, str]


def _record(job: _Job, grants: RealTimeGrants) -> RunSummary:
    plan = plan_run(job.rig, job.experiment)
    stop, timing = StopRequest(), RunTiming(job.pacer.period_ns)
    recorder = RecordingWriter(job.out, {**job.metadata, "real_time": json.dumps(grants.as_json())})
    try:
        with (
            stop_on_signals(stop),
            recorder,
            _described_at_the_end(recorder, timing),
            open_devices(job.rig) as devices,
            _traced(devices.link, job.trace) as trace,
            RunProgress(plan) as progress,
        ):

            def show(phase: Phase, time_s: float) -> None:
                if trace is not None:
                    trace.raise_if_failed()
                progress.show(phase, time_s)

            return run_plan(devices, plan, job.pacer, recorder, stop, show, timing)
    except BaseException:
        if recorder.kept is not None:
            typer.echo(f"{recorder.kept} holds the {recorder.n_samples} samples up to there", err=True)
        raise


@contextmanager
def _described_at_the_end(recorder: RecordingWriter, timing: RunTiming) -> Iterator[None]:
    """Put the timing into the recording, however the run ends."""
    try:
        yield
    finally:
        recorder.describe("timing", json.dumps(timing.as_json()))


@contextmanager
def _traced(link: CanLink, path: Path | None) -> Iterator[BusTrace | None]:
    """Trace the bus until the end of the block, however it ends; None where no trace was asked for."""
    if path is None:
        yield None
        return
    with BusTrace(path) as trace:
        link.trace_by(trace.take)
        try:
            yield trace
        finally:
            link.trace_by(None)


def _pacer(rig: Rig, pace: Pace) -> Pacer:
    if pace is Pace.REAL:
        return RealTimePacer(period_ns(rig.period_s))
    required_simulation(rig)
    if not rig.can.url.startswith(IN_PROCESS):
        bus_address(rig.can.url)  # a bus elsewhere may be a real one: SYNC would come at whatever rate it answers
    return FreePacer(period_ns(rig.period_s))


def _report(job: _Job, summary: RunSummary, grants: RealTimeGrants, as_json: bool) -> None:
    timing = summary.timing
    if as_json:
        document = {
            "schema": "hil.run/1",
            "recording": str(job.out),
            "trace": None if job.trace is None else str(job.trace),
            "cycles": summary.cycles,
            "recorded": summary.recorded,
            "flagged": summary.flagged,
            "most_late_ns": summary.most_late_ns,
            "timing": timing.as_json(),
            "real_time": grants.as_json(),
        }
        typer.echo(json.dumps(document))
        return
    typer.echo(
        f"{job.out}: {summary.recorded} samples, {summary.flagged} flagged; "
        f"latest cycle {summary.most_late_ns / 1e6:.1f} ms late"
    )
    for line in timing_lines(timing):
        typer.echo(f"  {line}")
    typer.echo(f"  {grants.statement}")
    if job.trace is not None:
        typer.echo(f"{job.trace}: every frame of the bus")


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
