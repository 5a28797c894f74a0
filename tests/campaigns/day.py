"""``python -m tests.campaigns.day [--hours H]``: one run of a whole day in simulated time, as ``hil run`` does it.

Recorded, estimated on line, entered into the store. Prints the memory of the process in each simulated hour, and at its
most when the recording has been given its name; exits 1 if either is more than in the second hour.
"""

import argparse
import resource
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from unittest import mock

from drivers.plc.plc import Plc
from hil.cli.run_job import RunJob, record
from hil.recording.recordings import read_facts
from hil.rig.experiments.base import Phase
from hil.rig.live import LiveEstimate, tracking_chain
from hil.rig.metadata import run_metadata
from hil.rig.pacing import FreePacer, period_ns
from hil.rig.realtime import NOT_ASKED
from hil.sample import Sample
from tests.rig.serving import EXAMPLE, changed, served, small_rig

GROWTH_MIB = 8.0
"""What the allocators may take more in a day; a row kept for each cycle would take hundreds."""

PUBLISHING_MIB = 250.0
"""What giving the recording its name may take, whatever its length: blocks of its text, the course of the estimate."""

HOUR_S = 3600.0

PATIENCE_S = 60.0
"""For answers [s]: of the wall clock, on a machine that does other things for most of an hour."""


def memory_mib() -> float:
    """Return what this process has of the memory now [MiB]."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return float(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS"))) / 1024.0


def most_memory_mib() -> float:
    """Return the most that this process has had of the memory so far [MiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


class Watched(LiveEstimate):
    """The estimate of a run that takes the memory in each simulated hour."""

    def __init__(self, period_s: float) -> None:
        super().__init__(tracking_chain(period_s))
        self.memory_mib: list[float] = []
        self._begun_s = time.monotonic()

    def __call__(self, sample: Sample, phase: Phase = Phase.MEASURE) -> None:
        super().__call__(sample, phase)
        if phase is Phase.MEASURE and sample.time_s >= HOUR_S * (len(self.memory_mib) + 0.5):
            self.memory_mib.append(memory_mib())
            self.show(str(len(self.memory_mib)), self.memory_mib[-1])

    def show(self, what: str, mib: float) -> None:
        """Print a row."""
        print(f"| {what} | {mib:.1f} | {time.monotonic() - self._begun_s:.0f} |", flush=True)


def run(hours: float, out: Path) -> tuple[list[float], float]:
    """Run for so long; return the memory in each simulated hour, and how much more it was at the end [MiB]."""
    patient = {"heartbeat_ms": 1000, "host_timeout_ms": 5000}
    tables = {"experiments.cruise": {"duration_s": hours * HOUR_S}, "inverters.m1": patient, "inverters.m2": patient}
    rig = changed(small_rig(), tables)
    live = Watched(rig.period_s)
    plc = partial(Plc, timeout_s=PATIENCE_S, beat_timeout_s=PATIENCE_S)
    with served(rig) as (_, at), mock.patch("hil.rig.build.Plc", plc):
        pacer = FreePacer(period_ns(rig.period_s), PATIENCE_S)
        record(RunJob(at, "cruise", out, None, pacer, run_metadata(EXAMPLE, "cruise"), live), NOT_ASKED)
    most_mib = most_memory_mib()
    live.show(f"published, {read_facts(out).extent.n_rows} rows: at most", most_mib)
    return live.memory_mib, most_mib - max(live.memory_mib, default=most_mib)


def main(arguments: list[str] | None = None) -> int:
    """Run a day."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.day")
    parser.add_argument("--hours", type=float, default=24.0)
    asked = parser.parse_args(arguments)
    print("| simulated hour | memory [MiB] | after [s] |")
    print("| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        memory, publishing = run(asked.hours, Path(name) / "run.csv")
    growth = max(memory[1:], default=0.0) - min(memory[1:], default=0.0)
    print(f"\nfrom the second hour on {growth:.1f} MiB more; when the recording got its name {publishing:.1f} MiB more")
    return int(growth > GROWTH_MIB or publishing > PUBLISHING_MIB)


if __name__ == "__main__":
    sys.exit(main())
