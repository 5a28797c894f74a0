"""A recording or a bus trace in place of a rig."""

from pathlib import Path
from typing import Any

import pytest

from hil.cli.main import run
from hil.errors import RecordingError
from hil.monitor.app import MonitorApp
from hil.monitor.messages import Began, Over, Report, Samples
from hil.monitor.opening import open_recording
from hil.monitor.source import ReplaySource, recorded_samples
from hil.recording.writer import RecordingWriter
from hil.sample import Sample, SampleFlag
from tests.monitor.fake_source import sample

SAMPLES = [sample(k, 0.5 * k, 0.1 * k, 120.0, SampleFlag(k % 7 == 3)) for k in range(100)]


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now_ns = 5_000_000_000

    def __call__(self) -> int:
        return self.now_ns

    def forward(self, seconds: float) -> None:
        self.now_ns += round(seconds * 1e9)


def samples_in(reports: list[Report]) -> list[Sample]:
    return [row for report in reports if isinstance(report, Samples) for row, _ in report.rows]


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_samples_come_when_they_are_due(speed: float) -> None:
    clock = Clock()
    with ReplaySource("r", SAMPLES, speed, clock_ns=clock) as source:
        first = list(source.poll())
        assert first[0] == Began("", "r", SAMPLES[-1].time_s)
        assert samples_in(first) == SAMPLES[:1]
        clock.forward(0.2 / speed)
        assert samples_in(list(source.poll())) == SAMPLES[1:21]
        clock.forward(10.0)
        last = list(source.poll())
        assert samples_in(last) == SAMPLES[21:]
        assert isinstance(last[-1], Over)
        assert last[-1].flagged == sum(bool(row.flags) for row in SAMPLES)
        assert list(source.poll()) == []


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_recording_comes_back_as_the_samples_it_is_of(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"r{suffix}"
    with RecordingWriter(path) as writer:
        for row in SAMPLES:
            writer.append(row)
    assert recorded_samples(path) == (SAMPLES, {})


def test_a_picture_of_a_page_is_drawn_when_asked_for_in_the_size_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RecordingWriter(tmp_path / "r.csv") as writer:
        for row in SAMPLES:
            writer.append(row)
    waited_s: list[float] = []
    timer = MonitorApp.set_timer

    def noted(app: MonitorApp, delay_s: float, then: Any) -> Any:
        waited_s.append(delay_s)
        return timer(app, delay_s, then)

    monkeypatch.setattr(MonitorApp, "set_timer", noted)
    picture = tmp_path / "screen.svg"
    line = ["monitor", "--replay", str(tmp_path / "r.csv"), "--speed", "1000", "--page", "log", "--size", "100x30"]
    assert run([*line, "--snapshot", str(picture), "--after", "0.7"]) == 0
    assert waited_s == [0.7]
    drawn = picture.read_text(encoding="utf-8").replace("&#160;", " ")
    assert "100 samples played, 14 of them flagged" in drawn
    assert "line-29)" in drawn
    assert "line-30)" not in drawn
    assert run([*line, "--snapshot", str(tmp_path / "never.svg"), "--after", "0"]) == 2


@pytest.mark.parametrize(
    ("rows", "said"), [("0,1,2,3\n0,1,2,3\n", "rise"), ("0,1,2,3\n", "got 1"), ("0,1,2,x\n", "column speed_rad_s")]
)
def test_a_recording_that_can_not_be_played_is_refused(tmp_path: Path, rows: str, said: str) -> None:
    path = tmp_path / "r.csv"
    path.write_text(f"time_s,torque_m1_nm,torque_m2_nm,speed_rad_s\n{rows}", encoding="utf-8")
    with pytest.raises(RecordingError, match=said):
        open_recording(path, None, 1.0, None)
