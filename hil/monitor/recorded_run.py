"""One experiment of the monitor: driven as `hil run` drives it, recorded, marked, entered into the run store."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from drivers.errors import DriverError
from estimator.errors import EstimatorError
from hil.config.rig_file import Rig
from hil.errors import HilError, UsageError
from hil.monitor.messages import Began, LogTopic, Mark, Notice, Over
from hil.monitor.outbox import Outbox
from hil.recording.writer import RecordingWriter
from hil.result_folder import publish
from hil.rig.build import Devices
from hil.rig.experiments.base import Phase
from hil.rig.live import USUAL, LiveEstimate, OnlineSetup, tracking_chain
from hil.rig.live_course import course_path
from hil.rig.metadata import run_metadata
from hil.rig.pacing import NS_PER_S, RealTimePacer, period_ns
from hil.rig.plan import Plan, plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.rig.timing import RunTiming
from hil.sample import Sample
from hil.store import register_run
from hil.store.entry import COMPLETE, ONLINE, found_changes

SUFFIX = ".parquet"
"""A format that carries units and metadata in the file itself."""

EVENTS = "events"
"""Key of the marks in the recording's metadata: a JSON list of time_s (or null), phase, text."""

STOPPED = "stopped by the operator"


class RecordedRun:
    """One run."""

    def __init__(
        self, rig_path: Path, rig: Rig, out: Path, name: str, outbox: Outbox, setup: OnlineSetup = USUAL
    ) -> None:
        self._setup = setup
        self._rig_path = rig_path
        self._rig = rig
        self._name = name
        self._outbox = outbox
        self._path = recording_path(out, name, datetime.now(UTC))
        self._events: list[dict[str, float | str | None]] = []
        self._now: tuple[Sample, Phase] | None = None
        self._flagged = 0
        self._live: LiveEstimate | None = None

    def mark(self, mark: Mark) -> None:
        """Put a mark at its time into the recording; from any thread."""
        time_s, phase = self._place(mark.t_ns)
        self._events.append({"time_s": time_s, "phase": phase, "text": mark.text})
        where = f"at {time_s:.2f} s of the recording" if time_s is not None else f"outside the recorded part ({phase})"
        self._outbox.tell(Notice(mark.t_ns, LogTopic.MARK, f"{mark.text} ({where})"))

    def drive(
        self,
        devices: Devices,
        stop: StopRequest,
        timing: RunTiming,
        watch: Callable[[int], None],
        metadata: Mapping[str, str],
    ) -> None:
        """Run it to its end, and tell how it went; what ends it early is reported, not raised."""
        said = {**run_metadata(self._rig_path, self._name), **metadata}
        recorder = RecordingWriter(self._path, said, 0.0, self._rig.channel_units)
        self._live = self._estimate()
        reason, stopped = None, False
        try:
            plan = plan_run(self._rig, self._name)
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with recorder:
                self._outbox.tell(Began(self._name, str(self._path), plan.experiment.duration_s))
                try:
                    self._drive(devices, plan, recorder, stop, timing, watch)
                finally:
                    recorder.describe("timing", json.dumps(timing.as_json()))
                    recorder.describe(EVENTS, json.dumps(self._events))
        except KeyboardInterrupt:
            stopped = True
        except (DriverError, HilError, OSError) as error:
            reason = " ".join((str(error), *getattr(error, "__notes__", ())))
        self._tell_end(recorder, timing, stopped, reason)

    def _drive(
        self,
        devices: Devices,
        plan: Plan,
        recorder: RecordingWriter,
        stop: StopRequest,
        timing: RunTiming,
        watch: Callable[[int], None],
    ) -> None:
        def observe(sample: Sample, phase: Phase) -> None:
            self._now = (sample, phase)
            self._outbox.sample(sample, phase)
            self._flagged += phase is Phase.MEASURE and bool(sample.flags)
            watch(sample.t_ns)

        pacer = RealTimePacer(period_ns(self._rig.period_s))
        observers = (observe,) if self._live is None else (observe, self._live)
        run_plan(devices, plan, pacer, recorder, stop, lambda phase, time_s: None, timing, observers)

    def _estimate(self) -> LiveEstimate | None:
        """Make the estimate that is kept next to the recording, as `hil run` does; None where there can be none."""
        try:
            return LiveEstimate(tracking_chain(self._rig.period_s, *self._setup))
        except EstimatorError:  # the view, which has the same chain, says why there is no estimate
            return None

    def _place(self, t_ns: int) -> tuple[float | None, str]:
        """Tell where in the run a moment of the monotonic clock is: time in the recording [s], and phase."""
        if self._now is None:
            return None, "before the first cycle"
        sample, phase = self._now
        time_s = sample.time_s + (t_ns - sample.t_ns) / NS_PER_S
        return (max(0.0, time_s) if phase is Phase.MEASURE else None), phase.value

    def _tell_end(self, recorder: RecordingWriter, timing: RunTiming, stopped: bool, reason: str | None) -> None:
        kept = recorder.written_file
        run_id = None if kept is None else self._registered(kept, STOPPED if stopped else reason or COMPLETE)
        n_alarms = 0 if self._live is None else len(found_changes(self._live.course.summary()))
        recording = None if kept is None else str(kept)
        self._outbox.tell(
            Over(self._name, recording, recorder.n_samples, self._flagged, stopped, reason, run_id, n_alarms)
        )

    def _registered(self, recording: Path, outcome: str) -> int | None:
        """Enter the recording into the run store of its folder; it stays whole where that can't be done."""
        course = self._kept_course()
        try:
            return register_run(recording, outcome, results={} if course is None else {ONLINE: course})
        except (HilError, OSError) as error:
            self._complain(f"run store: {error}")
            return None

    def _kept_course(self) -> Path | None:
        """Write resonance and alarms next to the recording; None where there are none or they can't be written."""
        if self._live is None:
            return None
        path = course_path(self._path)
        try:
            publish(path.parent, {path.name: self._live.course.write})
        except UsageError as error:
            self._complain(f"{path} is missing, 'hil replay' makes it again: {error}")
            return None
        return path

    def _complain(self, text: str) -> None:
        self._outbox.tell(Notice(time.monotonic_ns(), LogTopic.FAULT, text))


def recording_path(folder: Path, name: str, now: datetime) -> Path:
    """Name a new recording by experiment and time of day (UTC), free of any file that is there."""
    stem = f"{name}-{now:%Y%m%d-%H%M%S}"
    candidates = (folder / f"{stem}{suffix}{SUFFIX}" for suffix in ("", *(f"-{n}" for n in range(2, 1000))))
    return next(path for path in candidates if not path.exists())
