"""A run's timing record: what is counted, and that it is in the recording and the output however the run ends."""

import json
from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run as hil
from hil.config.rig_file import read_rig
from hil.recording.formats import read_table
from hil.rig.pacing import Tick
from hil.rig.timing import RunTiming, timing_lines
from tests.rig.serving import EXAMPLE, addresses, served

MS = 1_000_000


def test_period_lateness_and_missed_cycles_are_counted() -> None:
    timing = RunTiming(10 * MS)
    for tick in (Tick(0, 0, 0), Tick(1, 10 * MS, 6 * MS), Tick(4, 40 * MS, 1 * MS)):
        timing.begin(tick, tick.now_ns)
    assert (timing.cycles, timing.missed, timing.late) == (3, 2, 1)
    assert timing.lateness.max_ns == 6 * MS
    assert timing.period.max_ns == 25 * MS
    assert timing.period.total == 2


def test_document_has_the_histograms_and_their_quantiles() -> None:
    timing = RunTiming(10 * MS)
    for cycle in range(100):
        timing.begin(Tick(cycle, cycle * 10 * MS, cycle), cycle * 10 * MS)
    document = timing.as_json()
    assert document["schema"] == "hil.timing/1"
    assert document["lateness"]["p50_s"] == 49e-9
    assert document["lateness"]["max_s"] == 99e-9
    assert document["period"]["bins"][0][1] == 99
    assert document["reply_age"]["p99.9_s"] is None
    assert len(timing_lines(timing)) == 5


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_recording_keeps_timing_and_what_the_system_gave(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / f"run{suffix}"
    printed = run_reversal(tmp_path, out, capsys, "--pace", "fast")
    metadata = read_table(out).metadata
    timing = json.loads(metadata["timing"])
    assert timing == printed["timing"]
    assert timing["period"]["count"] == timing["cycles"] - 1
    assert timing["reply_age"]["count"] + timing["unanswered"] == 2 * timing["cycles"]
    assert metadata["pace"] == "fast"
    assert not json.loads(metadata["real_time"])["scheduling"]["given"]


@pytest.mark.campaign
def test_real_time_run_says_what_was_granted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run.csv"
    printed = run_reversal(tmp_path, out, capsys, "--pace", "real")
    granted = printed["real_time"]
    assert set(granted) == {"scheduling", "memory", "timer_slack"}
    assert all("granted" in grant["statement"] for grant in granted.values())
    assert json.loads(read_table(out).metadata["real_time"]) == granted


def run_reversal(folder: Path, out: Path, capsys: pytest.CaptureFixture[str], *options: str) -> dict[str, Any]:
    """Run the example's reversal, short and near standstill."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in (
        ("turning_speed_rad_s = 6.0", "turning_speed_rad_s = 0.2"),
        ("feedback_timeout_s = 0.2", "feedback_timeout_s = 5.0"),  # a test machine may be busy
        ('kind = "reversal"\nduration_s = 30.0', 'kind = "reversal"\nduration_s = 0.5'),
    ):
        assert text.count(before) == 1
        text = text.replace(before, after)
    file = folder / "rig.toml"
    file.write_text(text, encoding="utf-8")
    with served(read_rig(file)) as (server, _):
        assert hil(["run", str(file), "reversal", "--out", str(out), "--json", *addresses(server), *options]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document
