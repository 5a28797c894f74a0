"""What the faults of real processes are made with: a clock and a disk of their own."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.campaigns.faults.clock import Clock, compiler
from tests.campaigns.faults.disk import can_mount, disk

NOW = """
import datetime, time
print(time.time(), time.time_ns() / 1e9, datetime.datetime.now().timestamp(), time.monotonic())
"""


@pytest.mark.skipif(compiler() is None, reason="needs a C compiler")
def test_a_stepped_clock_is_off_by_the_step_and_the_monotonic_one_is_not(tmp_path: Path) -> None:
    clock = Clock(tmp_path)
    for step in (0, 3600, -3600):
        clock.step(step)
        before = time.time(), time.monotonic()
        command = [sys.executable, "-c", NOW]
        said = subprocess.run(command, env={**os.environ, **clock.environment}, check=True, capture_output=True).stdout
        *of_day, monotonic = map(float, said.split())
        for clocked in of_day:
            assert before[0] <= clocked - step <= time.time() + 1.0
        assert before[1] <= monotonic <= time.monotonic()


def test_a_full_disk_takes_nothing_and_a_stalled_one_takes_it_later(tmp_path: Path) -> None:
    if not can_mount():
        pytest.skip("needs to mount a disk, as root can")
    with disk(tmp_path) as mounted:
        file = (mounted.root / "file").open("wb", buffering=0)
        mounted.stall(0.3)
        began_s = time.monotonic()
        file.write(b"late")
        assert time.monotonic() - began_s > 0.2  # of the disk's own stall; a busy machine makes it longer
        mounted.await_end_of_stall()
        mounted.fill()
        with file, pytest.raises(OSError, match="No space left"):
            file.write(bytes(1 << 20))
