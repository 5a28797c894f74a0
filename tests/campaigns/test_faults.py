"""The campaign of faults in short: each fault once, at a moment and in an experiment drawn with a fixed seed."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hil.config.rig_file import Rig
from tests.campaigns import day
from tests.campaigns.faults.__main__ import draw, lengths
from tests.campaigns.faults.clock import Clock, compiler
from tests.campaigns.faults.disk import can_mount, disk
from tests.campaigns.faults.kinds import KINDS, UNTOUCHED
from tests.campaigns.faults.one_run import Outcome, run_with
from tests.campaigns.faults.processes import KINDS as PROCESS_KINDS, possible, run_one
from tests.campaigns.faults.rig import campaign_rig
from tests.campaigns.faults.runs import report
from tests.chosen import one_in

SEED = 7


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("faults")


@pytest.fixture(scope="module")
def rig(folder: Path) -> Rig:
    return campaign_rig(folder)


@pytest.fixture(scope="module")
def steps(rig: Rig, folder: Path) -> dict[str, int]:
    return lengths(rig, folder)


@pytest.mark.parametrize("number", one_in(6, range(len(KINDS))), ids=list(KINDS))
def test_a_fault_at_a_random_moment(number: int, rig: Rig, steps: dict[str, int], folder: Path) -> None:
    kind, experiment, at_s = draw(number, SEED, steps, rig.period_s)
    outcome = run_with(rig, experiment, KINDS[kind], at_s, folder, steps[experiment])
    assert outcome.problems == [], f"{kind} at {at_s} s of {experiment}"


def test_the_campaign_notices_a_wrong_end(rig: Rig, steps: dict[str, int], folder: Path) -> None:
    """A fault that is taken for nothing, for another cause, and not seen at all."""
    fault, other = KINDS["drive in fault"], KINDS["clutch closes"]
    assert "said" in run_with(rig, "tip", UNTOUCHED.__class__(fault.spec, other.cause), 0.5, folder).problems[0]
    missed = run_with(rig, "rest", UNTOUCHED.__class__("", fault.cause), 0.1, folder, steps["rest"])
    assert missed.problems == [f"went to its end with the fault at SYNC 10 of {steps['rest']}"]


def test_the_table_says_how_many_were_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    outcomes = {"drive hangs": [Outcome("said", 0.11), Outcome("said", 0.21, problems=["torque"]), Outcome()]}
    assert report(outcomes) == 1
    assert "| drive hangs | 3 | 2 | 0.21 | 1 |" in capsys.readouterr().out
    assert report({"drive hangs": [Outcome()]}) == 0


@pytest.mark.campaign
@pytest.mark.parametrize("kind", PROCESS_KINDS)
def test_a_fault_of_a_real_process(kind: str, tmp_path: Path) -> None:
    if kind not in possible():
        pytest.skip(f"this machine gives it no {PROCESS_KINDS[kind].needs} of its own")
    campaign_rig(tmp_path, by_the_clock=True)
    assert run_one(PROCESS_KINDS[kind], tmp_path / "rig.toml", "cruise", 0.5, real_time=True).problems == []


@pytest.mark.campaign
def test_half_a_minute_of_a_day(capsys: pytest.CaptureFixture[str]) -> None:
    assert day.main(["--hours", "0.01"]) == 0
    assert "| published, 3600 rows: at most |" in capsys.readouterr().out


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
