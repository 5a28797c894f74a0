"""``hil run``: one experiment, recorded; or, as a dry run, what it would do."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivers.canopen.can_link import CanLink
from hil.cli.filter_option import FilterOf, FilterRun, with_filter
from hil.cli.run_progress import RunProgress
from hil.config.rig_file import Rig, read_rig
from hil.errors import HilError, UsageError
from hil.recording.writer import RecordingWriter
from hil.report.outputs import publish
from hil.rig.addresses import with_addresses
from hil.rig.build import open_devices
from hil.rig.drive import RunSummary
from hil.rig.experiments.base import Phase
from hil.rig.live_course import course_path
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
from hil.store import register_run
from hil.store.entry import COMPLETE, ONLINE

if TYPE_CHECKING:
    from hil.rig.live import LiveEstimate
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
    estimate: Annotated[
        bool, typer.Option(help="Estimate while driving; its course goes beside the recording: .online.json.")
    ] = True,
    filter_of: FilterOf = None,
    filter_run: FilterRun = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Run one experiment, record its measured part, and follow the resonance while driving.

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
    live = live_estimate(rig_file, out, filter_of, filter_run) if estimate else None
    job = _Job(rig_file, experiment, out, trace, pacer_for(rig_file, pace), metadata, live)
    with real_time() if pace is Pace.REAL else nullcontext(NOT_ASKED) as grants:
        summary = _record(job, grants)
    _report(job, summary, grants, as_json)


def live_estimate(
    rig: Rig, recording: Path, filter_of: Path | None = None, filter_run: str | None = None
) -> LiveEstimate:
    """Make what estimates a run while it goes on.

    Raises
    ------
    UsageError
        If its file is there already, or the rig's period does not divide that of the models; see `with_filter` too.
    """
    from estimator.errors import BadSetting
    from hil.rig.live import LiveEstimate, tracking_chain, tracking_settings

    if course_path(recording).exists():
        raise UsageError(
            f"{course_path(recording)}: expected no such file, came one of an earlier run. Move it away, or choose "
            "another name with --out."
        )
    try:
        return LiveEstimate(tracking_chain(rig.period_s, *with_filter(tracking_settings(), filter_of, filter_run)))
    except BadSetting as error:
        raise UsageError(f"{error} Or record without an estimate: --no-estimate.") from error


@dataclass(frozen=True, slots=True)
class _Job:
    """One run as it was asked for."""

    rig: Rig
    experiment: str
    out: Path
    trace: Path | None
    pacer: Pacer
    metadata: dict[str, str]
    live: LiveEstimate | None


def _record(job: _Job, grants: RealTimeGrants) -> RunSummary:
    plan = plan_run(job.rig, job.experiment)
    stop, timing = StopRequest(), RunTiming(job.pacer.period_ns)
    recorder = RecordingWriter(job.out, {**job.metadata, "real_time": json.dumps(grants.as_json())})
    observers = () if job.live is None else (job.live,)
    ended_by = COMPLETE
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
                progress.show(phase, time_s, None if job.live is None else job.live.latest)

            return run_plan(devices, plan, job.pacer, recorder, stop, show, timing, observers)
    except BaseException as error:
        ended_by = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__
        if recorder.kept is not None:
            typer.echo(f"{recorder.kept} holds the {recorder.n_samples} samples up to there", err=True)
        raise
    finally:
        if job.live is not None and recorder.kept is not None:
            _keep_course(job.live, course_path(job.out))
        _register(job, recorder, ended_by)


def _keep_course(live: LiveEstimate, path: Path) -> None:
    """Write the course of the estimate; where that can't be done, what ended the run is still told."""
    try:
        publish(path.parent, {path.name: live.course.write})
    except UsageError as error:
        typer.echo(f"{path} is missing: {error}", err=True)


def _register(job: _Job, recorder: RecordingWriter, ended_by: str) -> None:
    """Enter the run into the store beside its recording, which stays whole where that can't be done."""
    if recorder.kept != job.out:
        return
    results = {ONLINE: course_path(job.out)} if course_path(job.out).exists() else {}
    try:
        register_run(job.out, ended_by, results=results)
    except HilError as error:
        typer.echo(f"{error}\n{job.out} is whole; 'hil runs rebuild --store {job.out.parent}' enters it.", err=True)


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


def pacer_for(rig: Rig, pace: Pace) -> Pacer:
    """Make the pacer of one run.

    Raises
    ------
    UsageError
        If it is to be fast and the rig is none that is simulated on this machine.
    """
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
            "online": None if job.live is None else job.live.course.summary(),
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
    if job.live is not None and summary.recorded:
        typer.echo(f"{course_path(job.out)}: {job.live.course.statement}")
        for alarm in job.live.course.alarms:
            typer.echo(f"  alarm: {alarm.statement}")


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
