"""``python -m tests.benchmarks.fleet``: two workers against one, what the engine costs, and how that grows.

The ratio of two workers to one needs two free cores: the load of the machine is printed with it. The engine's share is
what a worker's time is not spent in tasks while there is work. Growth is that of reading and hashing recordings, with
100 and with 10,000 short ones: what a task itself costs does not depend on how many there are.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
from distributed import Client

from hil.fleet.dataset import Writer, read
from hil.fleet.known import Survey
from hil.fleet.run import Engine, carry_out, client_of, survey
from hil.fleet.sources import find
from hil.fleet.tasks import IDENTIFY, FleetJob
from tests.benchmarks.buses import draw_bus, drive
from tests.benchmarks.ratios import table

MIB = 1 << 20


def write_drives(folder: Path, count: int, seconds: float) -> None:
    """Write drives of one bus each."""
    for number in range(count):
        record = drive(draw_bus(number), seconds)
        rows = np.column_stack([record.time_s, record.torque_nm, record.output])
        header = "time_s,torque_m1_nm,torque_m2_nm,speed_rad_s"
        path = folder / f"bus_{number}.csv"
        np.savetxt(path, rows, fmt="%.5f", delimiter=",", header=header, comments="")


def _no_progress(stage: str, done: int, total: int) -> None:
    """Show nothing."""


def identified(drives: Path, workers: int) -> tuple[float, float]:
    """Identify all; the time it took by the clock, and the sum of what the tasks took [s]."""
    found, _ = find([str(drives)], None)
    with tempfile.TemporaryDirectory() as place, client_of(Engine(workers=workers)) as client:
        warm_up, out = Path(place) / "warm_up", Path(place) / "results"
        for folder, some in ((warm_up, found[:workers]), (out, found[workers:])):
            job = FleetJob(IDENTIFY, None)
            fleet = survey(lambda: client, some, Survey([]), job, Engine(), _no_progress)
            started_s = time.perf_counter()
            carry_out(lambda: client, fleet, job, Writer(folder, job.command), Engine(), False, _no_progress)
            spent = time.perf_counter() - started_s
        return spent, sum(row["seconds"] for row in read(out, "recordings"))


def surveyed(client: Client, folder: Path, count: int) -> tuple[str, str, str, str]:
    """Read and hash short recordings; time of each, and the memory of client and worker."""
    drives = folder / str(count)
    drives.mkdir()
    for number in range(count):
        (drives / f"{number}.csv").write_text(f"time_s,torque_m1_nm,torque_m2_nm,speed_rad_s\n0,{number},1,1\n")
    found, _ = find([str(drives)], None)
    started_s = time.perf_counter()
    survey(lambda: client, found, Survey([]), FleetJob(IDENTIFY, None), Engine(), _no_progress)
    each_ms = 1e3 * (time.perf_counter() - started_s) / count
    (worker,) = client.run(resident_mib).values()
    return f"{count:,}", f"{each_ms:.1f} ms", f"{resident_mib():.0f} MiB", f"{worker:.0f} MiB"


def resident_mib() -> float:
    return float(psutil.Process().memory_info().rss / MIB)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drives", type=int, default=22)
    parser.add_argument("--seconds", type=float, default=30.0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        with client_of(Engine(workers=1)) as client:
            surveyed(client, folder, 10)
            rows = [surveyed(client, folder, count) for count in (100, 10_000)]
        sys.stdout.write(table(("recordings", "each", "client and scheduler", "worker"), rows))
        (folder / "drives").mkdir()
        write_drives(folder / "drives", options.drives, options.seconds)
        times = {workers: identified(folder / "drives", workers) for workers in (1, 2)}
    per_drive = {w: spent / (options.drives - w) for w, (spent, _) in times.items()}
    lines = [f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"]
    for workers, (spent, in_tasks) in times.items():
        share = 1.0 - in_tasks / (workers * spent)
        each = f"{per_drive[workers]:.2f} s a drive of {options.seconds:g} s"
        lines.append(f"{workers} workers: {each}, {share:.1%} not in tasks")
    lines.append(f"two workers: {per_drive[1] / per_drive[2]:.2f} times one")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
