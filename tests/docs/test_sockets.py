"""What docs/security.md says that each command listens at is what it listens at."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.cli.conftest import EXAMPLE

PAGE = Path(__file__).parents[2] / "docs" / "security.md"
ROWS = "time_s,torque_m1_nm,torque_m2_nm,speed_rad_s\n0,1,1,1\n0.01,1,1,1\n"
LONGEST_S = 300.0

pytestmark = [
    pytest.mark.skipif(not Path("/proc/net/tcp").is_file(), reason="no /proc/net"),
    pytest.mark.timeout(400),
]


def said(command: str) -> int:
    """Return how many sockets the page gives a command with one worker, that of the row before it included."""
    table = PAGE.read_text(encoding="utf-8").split("## What listens")[1].split("## ")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:3]] for line in table.splitlines() if line.startswith("| ")][2:]
    (place,) = (i for i, (commands, _) in enumerate(rows) if f"`{command}`" in commands)
    counted = sum(map(int, re.findall(r"\d+", rows[place][1])))
    following = rows[place + 1]
    return counted + (int(following[1]) if following[0] == "the same" else 0)


def family(process: int) -> Iterator[int]:
    """Yield a process and all that it has started."""
    yield process
    for children in Path(f"/proc/{process}/task").glob("*/children"):
        for child in children.read_text().split():
            yield from family(int(child))


def listening(process: int) -> set[str]:
    """Return the addresses that a process and what it has started listen at, in hexadecimal."""
    inodes = set()
    for each in family(process):
        for handle in Path(f"/proc/{each}/fd").iterdir():
            try:
                inodes.add(os.readlink(handle).removeprefix("socket:[").removesuffix("]"))
            except OSError:  # it was closed meanwhile
                continue
    lines = [line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()]
    return {words[1] for words in lines if words[3] == "0A" and words[9] in inodes}


def most_of(command: list[str], folder: Path, enough: Callable[[int], bool]) -> set[str]:
    """Run a command and return the largest set of addresses it listened at, until that is enough or it ends."""
    most: set[str] = set()
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "hil", *command], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        until_s = time.monotonic() + LONGEST_S
        while process.poll() is None and not enough(len(most)) and time.monotonic() < until_s:
            try:
                most = max(most, listening(process.pid), key=len)
            except OSError:  # a process of the family has ended meanwhile
                continue
            time.sleep(0.02)
        time.sleep(1.0 if process.poll() is None else 0.0)  # what still comes
        return max(most, listening(process.pid), key=len) if process.poll() is None else most
    finally:
        process.terminate()
        process.wait(60)


def is_loopback(address: str) -> bool:
    return address.startswith("0100007F:")


def test_the_simulated_rig(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(EXAMPLE.read_text(encoding="utf-8"), encoding="utf-8")
    command = ["sim", "rig.toml", "--bus", "ws://127.0.0.1:0/", "--modbus", "127.0.0.1:0"]
    found = most_of(command, tmp_path, lambda count: count >= said("hil sim"))
    assert len(found) == said("hil sim") == 2
    assert all(map(is_loopback, found))


def test_a_fleet_with_one_worker(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(ROWS)
    command = ["fleet", "identify", "a.csv", "--out", "results", "--jobs", "1"]
    found = most_of(command, tmp_path, lambda _: False)
    expected = said("hil fleet identify")
    assert expected == 3
    assert 1 <= len(found) <= expected + 2  # Dask's web servers, which answer nothing and are closed at once
    assert all(map(is_loopback, found))


def test_a_command_that_is_not_in_the_table(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(ROWS)
    assert said("hil sim") > 0
    assert most_of(["identify", "a.csv", "--out", "out"], tmp_path, lambda count: count > 0) == set()
