"""One run from arming to the entry in the store: predicted or driven, recorded, traced, followed, shown."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from drivers.canopen.can_link import CanLink
from hil.cli.options import with_filter
from hil.cli.printing import new_console, say
from hil.config.rig_file import Rig
from hil.errors import HilError, UsageError
from hil.recording.writer import RecordingWriter
from hil.result_folder import publish
from hil.rig.build import open_devices
from hil.rig.drive import CycleProgress as ShowCycle, RunSummary
from hil.rig.experiments.base import Phase
from hil.rig.live_course import course_path, statement
from hil.rig.pacing import Pacer, device_patience_s, disk_patience_s
from hil.rig.plan import Plan, plan_run
from hil.rig.realtime import NOT_ASKED, RealTimeGrants
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest, stop_on_signals
from hil.rig.timing import RunTiming, timing_lines
from hil.rig.trace import BusTrace
from hil.store import register_run
from hil.store.entry import COMPLETE, ONLINE, statements

if TYPE_CHECKING:
    from hil.rig.damper import Damping
    from hil.rig.live import LiveEstimate

SHOW_EVERY_S = 0.1
"""Time between two changes of the bar [s of the run]; the cycle has better things to do."""


def live_estimate(
    rig: Rig, recording: Path, filter_of: Path | None = None, filter_run: str | None = None
) -> LiveEstimate:
    """Make what estimates a run while it lasts."""
    from estimator.errors import BadSetting
    from hil.rig.live import LiveEstimate, tracking_chain, tracking_settings

    if course_path(recording).exists():
        raise UsageError(
            f"{course_path(recording)}: expected no such file, got one of an earlier run. Move it away, or choose "
            "another name with --out."
        )
    try:
        return LiveEstimate(tracking_chain(rig.period_s, *with_filter(tracking_settings(), filter_of, filter_run)))
    except BadSetting as error:
        raise UsageError(f"{error} Or record without an estimate: --no-estimate.") from error


def keep_course(live: LiveEstimate, path: Path) -> None:
    """Write the course of the estimate; where that can't be done, what ended the run is still reported."""
    try:
        publish(path.parent, {path.name: live.course.write})
    except UsageError as error:
        say(f"{path} is missing: {error}", err=True)


def damping(path: Path, live: LiveEstimate | None) -> Damping:
    """Make the damper of a file, supervised by the estimate of the run."""
    if live is None:
        raise UsageError(
            "--damper: expected the on-line estimate, which supervises it, got --no-estimate. Leave it out."
        )
    from hil.config.damper_file import drivable
    from hil.rig.damper import Damping

    return Damping(*drivable(path), live)


@dataclass(frozen=True, slots=True)
class RunJob:
    """One run as it was asked for."""

    rig: Rig  # at the addresses that count
    experiment: str  # its name in the rig file
    out: Path  # the recording
    trace: Path | None  # of the bus; None: none is written
    pacer: Pacer  # by the wall clock or as fast as answers come
    metadata: dict[str, str]  # that the recording says of itself, besides what the end of the run adds
    live: LiveEstimate | None  # None without an on-line estimate
    damper: Damping | None = None  # None without --damper


def record(job: RunJob, grants: RealTimeGrants) -> RunSummary:
    """Drive the experiment and record it; what was measured is kept and entered on every way out."""
    plan = plan_run(job.rig, job.experiment, job.damper)
    stop, timing = StopRequest(), RunTiming(job.pacer.period_ns)
    recorder = RecordingWriter(
        job.out,
        {**job.metadata, "real_time": json.dumps(grants.as_json())},
        disk_patience_s(job.pacer),
        job.rig.channel_units,
    )
    observers = [each for each in (job.live, job.damper) if each is not None]
    ended_by = COMPLETE
    try:
        with (
            stop_on_signals(stop),
            recorder,
            _described_at_the_end(recorder, timing),
            open_devices(job.rig, device_patience_s(job.pacer)) as devices,
            _traced(devices.link, job.trace) as trace,
            run_progress(plan, job.live) as show_cycle,
        ):

            def show(phase: Phase, time_s: float) -> None:
                if trace is not None:
                    trace.raise_if_failed()
                show_cycle(phase, time_s)

            return run_plan(devices, plan, job.pacer, recorder, stop, show, timing, observers)
    except BaseException as error:
        ended_by = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error) or type(error).__name__
        if recorder.written_file is not None:
            say(f"{recorder.written_file} holds the {recorder.n_samples} samples up to there", err=True)
        raise
    finally:
        if job.live is not None and recorder.written_file is not None:
            keep_course(job.live, course_path(job.out))
        _register(job, recorder, ended_by)


def _register(job: RunJob, recorder: RecordingWriter, ended_by: str) -> None:
    """Enter the run into the store next to its recording, which stays whole where that can't be done."""
    if recorder.written_file != job.out:
        return
    results = {ONLINE: course_path(job.out)} if course_path(job.out).exists() else {}
    try:
        register_run(job.out, ended_by, results=results)
    except HilError as error:
        say(f"{error}\n{job.out} holds the run; 'hil runs rebuild --store {job.out.parent}' enters it.", err=True)


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


def predict(rig: Rig, experiment: str, as_json: bool, trust_laws: bool) -> None:
    """Print torque and speed of an experiment as predicted."""
    from hil.rig.dry_run import dry_run  # brings the simulation along

    prediction = dry_run(rig, experiment, trust_laws)
    if as_json:
        say(json.dumps({"schema": "hil.dry_run/1", "experiment": experiment, **asdict(prediction)}))
        return
    rows = (
        ("base torque of both inverters", prediction.torque_nm, "Nm"),
        ("torque of m1, PRBS included", prediction.torque_m1_nm, "Nm"),
        ("torque of m2, PRBS included", prediction.torque_m2_nm, "Nm"),
        ("speed", prediction.speed_rad_s, "rad/s"),
        ("speed in the recorded part", prediction.speed_measured_rad_s, "rad/s"),
    )
    say(
        f"{experiment}: {prediction.cycles * prediction.period_s:.1f} s, "
        f"{prediction.measured * prediction.period_s:.1f} s of it recorded"
    )
    for what, values, unit in rows:
        say(f"  {what:32}{values.low:10.2f} to {values.high:8.2f} {unit}")
    say(f"  predicted with {prediction.vehicle.source}; the torque guard lets every cycle through")


def print_result(job: RunJob, summary: RunSummary, grants: RealTimeGrants, as_json: bool) -> None:
    """Print how a run went: samples, how evenly it ran, what the on-line estimate made of it."""
    if as_json:
        say(json.dumps(_document(job, summary, grants)))
        return
    say(
        f"{job.out}: {summary.recorded} samples, {summary.flagged} flagged; "
        f"latest cycle {summary.most_late_ns / 1e6:.1f} ms late"
    )
    for line in timing_lines(summary.timing):
        say(f"  {line}")
    if job.damper is not None:
        from hil.rig.damper import damping_lines

        for line in damping_lines(job.damper.document()):
            say(line)
    if grants is not NOT_ASKED:
        say(f"  {grants.statement}")
    if job.trace is not None:
        say(f"{job.trace}: every frame of the bus")
    if job.live is not None and summary.recorded:
        say(f"{course_path(job.out)}: {job.live.course.statement}")
        if job.live.course.excitation:
            say(f"  {job.live.course.excitation}")
        for statement in statements(job.live.course.summary()):
            say(f"  alarm: {statement}")


def _document(job: RunJob, summary: RunSummary, grants: RealTimeGrants) -> dict[str, Any]:
    return {
        "schema": "hil.run/1",
        "recording": str(job.out),
        "trace": None if job.trace is None else str(job.trace),
        "cycles": summary.cycles,
        "recorded": summary.recorded,
        "flagged": summary.flagged,
        "most_late_ns": summary.most_late_ns,
        "timing": summary.timing.as_json(),
        "real_time": grants.as_json(),
        "online": None if job.live is None else job.live.course.summary(),
        "damper": None if job.damper is None else job.damper.document(),
    }


@contextmanager
def run_progress(plan: Plan, live: LiveEstimate | None = None) -> Iterator[ShowCycle]:
    """Show a bar of one run on standard error, where that is a terminal, with the estimate where there is one."""
    console = new_console(stderr=True)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:.1f} s"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[estimate]}", markup=False),
    )
    last: tuple[Phase, float] | None = None
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(plan.name, total=plan.experiment.duration_s, estimate="")

        def show(phase: Phase, time_s: float) -> None:
            nonlocal last
            if last is not None and last[0] is phase and time_s - last[1] < SHOW_EVERY_S:
                return
            last = (phase, time_s)
            measured_s = time_s if phase is Phase.MEASURE else None
            said = "" if live is None or live.latest is None else statement(live.latest)
            bar.update(task, description=f"{plan.name}: {phase.value}", completed=measured_s, estimate=said)

        yield show
