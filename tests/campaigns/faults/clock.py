"""The system's clock, stepped for some processes only: `stepped_clock.c` between them and the C library.

libfaketime does the same, but its version 0.9.10 refuses the absolute monotonic sleeps of Python 3.11.
"""

import mmap
import shutil
import subprocess
from pathlib import Path

SOURCE = Path(__file__).with_name("stepped_clock.c")


def compiler() -> str | None:
    """Find a C compiler; None where there is none."""
    return shutil.which("cc") or shutil.which("gcc")


class Clock:
    """The time of day of the processes that are started with its environment."""

    def __init__(self, folder: Path) -> None:
        self._library, self._path = folder / "stepped_clock.so", folder / "clock_offset"
        found = compiler()
        if found is None:
            raise FileNotFoundError("expected a C compiler, cc or gcc")
        if not self._library.exists():
            subprocess.run([found, "-shared", "-fPIC", "-O1", "-o", self._library, SOURCE], check=True)
        self._path.write_bytes(bytes(8))

    def step(self, seconds: int) -> None:
        """Set it so far off the machine's; the monotonic clock is not changed."""
        with self._path.open("r+b") as file, mmap.mmap(file.fileno(), 8) as content:
            content[:] = seconds.to_bytes(8, "little", signed=True)

    @property
    def environment(self) -> dict[str, str]:
        """What a process has to be started with."""
        return {"LD_PRELOAD": str(self._library), "CLOCK_OFFSET_FILE": str(self._path)}
