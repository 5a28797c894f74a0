"""``python -m tests.benchmarks.growth [identify] [diagnose] [--fast]``: time and memory over the recordings' size.

Each size is a process of its own: longer recordings, more of them, and a million samples at 1 kHz. ``growth`` is by how
much more processor time a sample takes than one of the first size: 1 is in proportion, and the limit is 1.3.
``--fast`` leaves out what takes longer than a minute.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from tests.benchmarks.cases import NOTHING, make
from tests.benchmarks.fit import SEED
from tests.benchmarks.memory import write_case
from tests.benchmarks.ratios import machine, table

JOBS = ("identify", "diagnose")
LIMIT = 1.3
COLUMNS = ("job", "recordings", "samples", "processor time", "peak memory", f"growth (at most {LIMIT})", "verdict")


class Size(NamedTuple):
    """So many recordings of so many seconds, read so often in 10 ms."""

    count: int
    seconds: float
    reads: int = 1

    @property
    def samples(self) -> int:
        """Samples of all of them."""
        return round(self.count * self.seconds * 100.0) * self.reads


SIZES = (Size(1, 30.0), Size(1, 100.0), Size(1, 300.0), Size(3, 30.0), Size(12, 30.0), Size(1, 30.0, 10))
LONG = (Size(1, 1000.0, 10),)


def measured(job: str, size: Size) -> dict[str, float | str]:
    """Do a job of a size in a process of its own and return what it took."""
    with tempfile.TemporaryDirectory(prefix="hil-growth-") as folder:
        path = Path(folder) / "case.npz"
        write_case(path, make(NOTHING, SEED, size.seconds, size.reads, size.count))
        command = [sys.executable, "-m", "tests.benchmarks.memory", str(path), job]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    found: dict[str, float | str] = json.loads(done.stdout)
    return found


def rows(job: str, sizes: Sequence[Size]) -> list[tuple[str, ...]]:
    """Return the lines of a job, the first size first: the others are compared with it."""
    measured(job, sizes[0])  # compiles, or reads what was compiled
    taken = [measured(job, size) for size in sizes]
    first_s = float(taken[0]["processor_s"]) / sizes[0].samples
    return [
        (
            job,
            f"{size.count} × {size.seconds:g} s{' at 1 kHz' if size.reads > 1 else ''}",
            f"{size.samples}",
            f"{float(each['processor_s']):.3g} s",
            f"{float(each['peak_mib']):.0f} MiB",
            f"{float(each['processor_s']) / size.samples / first_s:.2f}",
            str(each["verdict"]),
        )
        for size, each in zip(sizes, taken, strict=True)
    ]


def main() -> int:
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("jobs", nargs="*", metavar="JOB", help=f"{', '.join(JOBS)} (default: both)")
    parser.add_argument("--fast", action="store_true", help="without a million samples")
    asked = parser.parse_args()
    if unknown := [job for job in asked.jobs if job not in JOBS]:
        parser.error(f"expected {' or '.join(JOBS)}, got {', '.join(unknown)}")
    sizes = SIZES if asked.fast else (*SIZES, *LONG)
    lines = [line for job in asked.jobs or JOBS for line in rows(job, sizes)]
    sys.stdout.write(f"{machine()}\n{table(COLUMNS, lines)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
