"""``python -m tests.benchmarks.compiling``: processor time that a first use takes to compile, by kernel and masses.

Each kernel is compiled in a process of its own, one after the other, with a cache that is thrown away.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence

from estimator.diagnosis.first_use import signatures
from tests.benchmarks.ratios import machine

MASSES = (2, 3, 1)

COMPILED = """
import sys, time
from estimator.diagnosis.first_use import compile_named
before = time.process_time()
compile_named(int(sys.argv[1]), sys.argv[2])
print(time.process_time() - before)
"""


def seconds(masses: int, name: str) -> float:
    """Return the processor time of compiling one kernel, with nothing on disk [s]."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, "-c", COMPILED, str(masses), name],
            env={**os.environ, "NUMBA_CACHE_DIR": cache, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            capture_output=True,
            text=True,
            check=True,
        )
    return float(done.stdout)


def main(say: Callable[[str], None] = print) -> None:
    """Print the table."""
    say(machine())
    say("| kernel | two masses | three | one |\n| --- | --- | --- | --- |")
    rows = []
    for kernel in signatures(MASSES[0]):
        rows.append([seconds(masses, kernel.__name__) for masses in MASSES])
        say(_row(f"`{kernel.__name__}`", rows[-1]))
    say(_row("all", [sum(column) for column in zip(*rows, strict=True)]))


def _row(name: str, times_s: Sequence[float]) -> str:
    return f"| {name} | " + " | ".join(f"{each:.1f} s" for each in times_s) + " |"


if __name__ == "__main__":
    main()
