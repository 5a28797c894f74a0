"""``python -m tests.campaigns.day [--hours H]``: one run of a whole day in simulated time, recorded and estimated.

Prints the memory of the process for each simulated hour, and once more when the recording has its name; exits 1 if the
run took more in its last hour than in its second one.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from hil.recording import RecordingWriter
from hil.rig.build import open_devices
from hil.rig.experiments.base import Phase
from hil.rig.live import LiveEstimate, tracking_chain
from hil.rig.pacing import FreePacer, heartbeat_patience_ms, period_ns
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from tests.rig.serving import changed, served, small_rig

GROWTH_MIB = 8.0
"""What the allocators may take more in a day; a row kept for each cycle would take hundreds."""

HOUR_S = 3600.0


def memory_mib() -> float:
    """Return what this process has of the memory now [MiB]."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return float(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS"))) / 1024.0


def run(hours: float, out: Path) -> list[float]:
    """Run for so long; return the memory in each simulated hour, and at the end, each printed."""
    patient = {"heartbeat_ms": 1000, "host_timeout_ms": 5000}  # of the wall clock, on a machine that does other things
    tables = {"experiments.cruise": {"duration_s": hours * HOUR_S}, "inverters.m1": patient, "inverters.m2": patient}
    rig = changed(small_rig(), tables)
    memory: list[float] = []
    began_s = time.monotonic()

    def progress(phase: Phase, time_s: float) -> None:
        if time_s >= HOUR_S * (len(memory) + 0.5):
            memory.append(memory_mib())
            print(f"| {len(memory)} | {memory[-1]:.1f} | {time.monotonic() - began_s:.0f} |", flush=True)

    live = LiveEstimate(tracking_chain(rig.period_s))
    pacer = FreePacer(period_ns(rig.period_s), 60.0)
    patience_ms = heartbeat_patience_ms(pacer)
    with served(rig) as (_, at), RecordingWriter(out) as recorder, open_devices(at, patience_ms) as devices:
        run_plan(devices, plan_run(at, "cruise"), pacer, recorder, StopRequest(), progress, observers=(live,))
        rows = recorder.n_samples
    print(f"| published, {rows} rows | {memory_mib():.1f} | {time.monotonic() - began_s:.0f} |")
    return memory


def main(arguments: list[str] | None = None) -> int:
    """Run a day."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.day")
    parser.add_argument("--hours", type=float, default=24.0)
    asked = parser.parse_args(arguments)
    print("| simulated hour | memory [MiB] | after [s] |")
    print("| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        memory = run(asked.hours, Path(name) / "run.csv")
    growth = max(memory[1:], default=0.0) - min(memory[1:], default=0.0)
    print(f"\nfrom the second hour on {growth:.1f} MiB more")
    return int(growth > GROWTH_MIB)


if __name__ == "__main__":
    sys.exit(main())
