"""The bare C loop (``bare_loop.c``), compiled when it is needed, and what it does in time."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

SOURCE = Path(__file__).with_suffix(".c")


@contextmanager
def compiled() -> Iterator[Path]:
    """Compile the loop, for the time of the block; needs a C compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise FileNotFoundError("expected gcc or cc for the loop to compare with, got neither: install a C compiler")
    with TemporaryDirectory(prefix="hil-bare-loop-") as folder:
        program = Path(folder) / "bare_loop"
        subprocess.run([compiler, "-O2", "-Wall", "-Werror", "-o", str(program), str(SOURCE)], check=True)
        yield program


def lateness_ns(program: Path, period_ns: int, count: int, priority: int) -> list[int]:
    """Run the loop: how late each cycle began [ns]; ``priority`` of SCHED_FIFO, 0 for ordinary scheduling."""
    command = [str(program), str(period_ns), str(count), str(priority)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return [int(line) for line in done.stdout.split()]
