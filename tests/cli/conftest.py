"""The command line as a user has it: in this process, and as processes of their own."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.without_budget import all_the_time_it_needs

__all__ = ["all_the_time_it_needs"]

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "rig.toml"
ANY_ADDRESS = ("--bus", "ws://127.0.0.1:0/", "--modbus", "127.0.0.1:0")


@dataclass(frozen=True)
class Simulation:
    """A running ``hil sim`` and where it serves."""

    process: subprocess.Popen[str]
    bus: str
    modbus: str

    @property
    def addresses(self) -> tuple[str, ...]:
        """Options with which another command finds it."""
        return ("--bus", self.bus, "--modbus", self.modbus)


@pytest.fixture
def spawn() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start ``hil`` as a process; what still runs at the end of the test is killed."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", "hil", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def simulate(spawn: Callable[..., subprocess.Popen[str]]) -> Callable[..., Simulation]:
    """Start ``hil sim`` on free ports and wait until it is ready."""

    def start(rig: Path, *options: str) -> Simulation:
        process = spawn("sim", str(rig), *ANY_ADDRESS, *options)
        assert process.stdout is not None
        word, bus, modbus = process.stdout.readline().split()
        assert word == "ready"
        return Simulation(process, bus.removeprefix("bus="), modbus.removeprefix("modbus="))

    return start


@pytest.fixture
def short_rig(tmp_path: Path) -> Path:
    """Write the example rig with experiments at or near standstill, and a short reversal."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in (
        ("speed_rad_s = 60.0", "speed_rad_s = 0.0"),
        ("feedback_timeout_s = 0.2", "feedback_timeout_s = 1.0"),  # a test machine may be busy
        ("turning_speed_rad_s = 6.0", "turning_speed_rad_s = 0.5"),
        ("# host_timeout_ms = 150 ", "host_timeout_ms = 1000 "),
        ("node_id = 2\n", "node_id = 2\nhost_timeout_ms = 1000\n"),
        ('kind = "reversal"\nduration_s = 30.0', 'kind = "reversal"\nduration_s = 3.0'),
    ):
        assert text.count(before) == 1
        text = text.replace(before, after)
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return path


def await_rows(part: Path, process: subprocess.Popen[str]) -> None:
    """Follow the file as it is written, until it has its first rows."""
    while process.poll() is None:
        if part.exists() and part.read_text(encoding="utf-8").count("\n") > 10:
            return
        time.sleep(0.01)  # the processor is for those who write
    raise AssertionError(process.communicate())
