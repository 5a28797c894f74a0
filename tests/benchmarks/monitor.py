"""Does the view delay the cycle? The same experiment with and without a view, on a rig served by another process.

Run it by ``python -m tests.benchmarks.monitor``: one line each, lateness in milliseconds and counts. Without a view the
rig's process has someone at the other end who takes the samples and draws nothing.
"""

import argparse
import sys
import tempfile
import threading
import time
from pathlib import Path

from hil.config.rig_file import Rig, read_rig
from hil.monitor.app import MonitorApp
from hil.monitor.host import Job
from hil.monitor.live_estimation import run_once
from hil.monitor.messages import Health, Over, Ready, Report, Samples, Start, Stop, TimingHealth
from hil.monitor.source import RigSource
from hil.monitor.state import LiveState
from tests.benchmarks.fieldbus import EXAMPLE, served_elsewhere


class Noted:
    """A source that is watched: starts the experiment, notes the timing of its cycles, stops it after a time."""

    can_drive = True

    def __init__(self, source: RigSource, experiment: str, seconds: float) -> None:
        self._source = source
        self._experiment = experiment
        self._seconds = seconds
        self._begun_s = 0.0
        self.timing: TimingHealth | None = None
        self.over = threading.Event()

    def __getattr__(self, name: str) -> object:
        return getattr(self._source, name)

    def poll(self) -> list[Report]:
        """Pass on what has come."""
        reports = list(self._source.poll())
        for report in reports:
            self._note(report)
        if self._begun_s and time.monotonic() - self._begun_s > self._seconds:
            self._source.send(Stop())
        return reports

    def _note(self, report: Report) -> None:
        if isinstance(report, Ready) and not self._begun_s:
            self._source.send(Start(self._experiment))
        elif isinstance(report, Samples) and report.rows[-1][1] is not None:
            self._begun_s = self._begun_s or time.monotonic()
        elif isinstance(report, Health) and self._begun_s and not self.over.is_set():
            self.timing = report.timing
        elif isinstance(report, Over):
            self.over.set()


def measure(rig: Rig, with_view: bool, seconds: float, out: Path) -> TimingHealth:
    """Drive a reversal for some seconds; give the timing of its cycles."""
    with RigSource(Job(EXAMPLE, rig, out)) as source:
        noted = Noted(source, "reversal", seconds)
        if with_view:
            view = MonitorApp(noted, LiveState("bus", rig.period_s, None, can_drive=True))  # type: ignore[arg-type]
            threading.Thread(target=lambda: (noted.over.wait(), view.call_from_thread(view.exit)), daemon=True).start()
            view.run(headless=True, size=(160, 50))
        else:
            while not noted.over.is_set():
                noted.poll()
                time.sleep(0.125)
    assert noted.timing is not None
    return noted.timing


def main() -> None:
    """Measure both in turn, as often as asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--rounds", type=int, default=2)
    arguments = parser.parse_args()
    run_once(read_rig(EXAMPLE).period_s)
    sys.stdout.write(f"{'':14}{'p50':>8}{'p99':>8}{'max':>8} ms   cycles  late  missed  no answer\n")
    with served_elsewhere(read_rig(EXAMPLE), "--real-time") as rig, tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            for with_view in (False, True):
                t = measure(rig, with_view, arguments.seconds, Path(folder))
                times = "".join(f"{1e3 * s:8.2f}" for s in (t.lateness_p50_s, t.lateness_p99_s, t.lateness_max_s))
                counts = f"{t.cycles:9}{t.late:6}{t.missed:8}{t.unanswered:11}"
                sys.stdout.write(f"{'with view' if with_view else 'without view':14}{times}   {counts}\n")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
