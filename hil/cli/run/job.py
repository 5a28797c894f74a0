"""One run from arming to the entry in the store: driven, recorded, traced, followed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from drivers.canopen.can_link import CanLink
from hil.cli.printing import say
from hil.cli.run.live import keep_course
from hil.cli.run_progress import RunProgress
from hil.config.rig_file import Rig
from hil.errors import HilError
from hil.recording.writer import RecordingWriter
from hil.rig.build import open_devices
from hil.rig.drive import RunSummary
from hil.rig.experiments.base import Phase
from hil.rig.live_course import course_path
from hil.rig.pacing import Pacer, disk_patience_s, heartbeat_patience_ms
from hil.rig.plan import plan_run
from hil.rig.realtime import RealTimeGrants
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest, stop_on_signals
from hil.rig.timing import RunTiming
from hil.rig.trace import BusTrace
from hil.store import register_run
from hil.store.entry import COMPLETE, ONLINE

if TYPE_CHECKING:
    from hil.rig.live import LiveEstimate


@dataclass(frozen=True, slots=True)
class Job:
    """One run as it was asked for."""

    rig: Rig
    experiment: str
    out: Path
    trace: Path | None
    pacer: Pacer
    metadata: dict[str, str]
    live: LiveEstimate | None


def record(job: Job, grants: RealTimeGrants) -> RunSummary:
    """Drive the experiment and record it; what was measured is kept and entered on every way out."""
    plan = plan_run(job.rig, job.experiment)
    stop, timing = StopRequest(), RunTiming(job.pacer.period_ns)
    recorder = RecordingWriter(
        job.out,
        {**job.metadata, "real_time": json.dumps(grants.as_json())},
        disk_patience_s(job.pacer),
        job.rig.channel_units,
    )
    observers = () if job.live is None else (job.live,)
    ended_by = COMPLETE
    try:
        with (
            stop_on_signals(stop),
            recorder,
            _described_at_the_end(recorder, timing),
            open_devices(job.rig, heartbeat_patience_ms(job.pacer)) as devices,
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
            say(f"{recorder.kept} holds the {recorder.n_samples} samples up to there", err=True)
        raise
    finally:
        if job.live is not None and recorder.kept is not None:
            keep_course(job.live, course_path(job.out))
        _register(job, recorder, ended_by)


def _register(job: Job, recorder: RecordingWriter, ended_by: str) -> None:
    """Enter the run into the store next to its recording, which stays whole where that can't be done."""
    if recorder.kept != job.out:
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
