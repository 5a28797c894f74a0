"""What stays of a monitor's run: recording, course of the estimate, alarms, entry in the store."""

import json
import multiprocessing
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol, cast

import pytest

from drivers.errors import DeviceTimeout
from estimator.physics.joint import Shaft
from hil.config.rig_file import read_rig
from hil.monitor import recorded_run
from hil.monitor.messages import Notice, Over, Report
from hil.monitor.outbox import Outbox
from hil.monitor.recorded_run import RecordedRun
from hil.recording import read_record
from hil.rig.build import Devices
from hil.rig.drive import Observer, Recorder
from hil.rig.experiments.base import Phase
from hil.rig.live import USUAL, OnlineSetup, Pace, play_record, tracking_settings
from hil.rig.stop import StopRequest
from hil.rig.timing import RunTiming
from hil.sample import Sample
from hil.simulator.driveline import DEFAULT_BUS
from hil.store import RunStore
from hil.store.entry import ONLINE
from tests.monitor.fake_source import sample
from tests.monitor.two_mass import driven

CYCLES = 4000
"""Forty seconds before a shaft gets softer, and as many after it: the watch needs its reference first."""


@pytest.fixture(scope="module")
def rows() -> list[Sample]:
    """Samples of a shaft that loses a fifth of its stiffness half-way."""
    whole = Shaft.of_model(DEFAULT_BUS, "test")
    assert whole is not None
    found: list[Sample] = []
    for shaft in (whole, replace(whole, k=0.8 * whole.k)):
        drive = driven(shaft, CYCLES, seed=1, speed_std_rad_s=0.05)
        for torque, speed in zip(drive.torque_nm.tolist(), drive.speed_rad_s.tolist(), strict=True):
            found.append(sample(len(found), torque, speed))
    return found


class Kept(Outbox):
    """An outbox whose reports stay here."""

    def __init__(self) -> None:
        super().__init__(multiprocessing.Pipe()[1])
        self.reports: list[Report] = []

    def tell(self, report: Report) -> None:
        self.reports.append(report)


class Drive(Protocol):
    """Runs a cruise of given cycles, recorded into a folder."""

    def __call__(self, samples: list[Sample], out: Path, setup: OnlineSetup = USUAL) -> Over: ...


@pytest.fixture
def drive(rig_path: Path, monkeypatch: pytest.MonkeyPatch) -> Drive:
    """Run a cruise whose cycles are given, and end it as a drive that falls silent does."""

    def run(samples: list[Sample], out: Path, setup: OnlineSetup = USUAL) -> Over:
        def cycles(*arguments: object) -> None:
            recorder, observers = cast(Recorder, arguments[3]), cast("Sequence[Observer]", arguments[7])
            for row in samples:
                recorder.append(row)
                for observe in observers:
                    observe(row, Phase.MEASURE)
            raise DeviceTimeout("inverter m2: no TPDO")

        monkeypatch.setattr(recorded_run, "run_plan", cycles)
        reported = Kept()
        run = RecordedRun(rig_path, read_rig(rig_path), out, "cruise", reported, setup)
        run.drive(cast(Devices, None), StopRequest(), RunTiming(10_000_000), lambda t_ns: None, {})
        assert not any(isinstance(report, Notice) for report in reported.reports), reported.reports
        return next(report for report in reported.reports if isinstance(report, Over))

    return run


@pytest.mark.campaign
def test_a_change_is_kept_next_to_the_recording_and_in_the_store(
    rows: list[Sample], drive: Drive, tmp_path: Path
) -> None:
    over = drive(rows, tmp_path)
    assert over.recording is not None
    recording = Path(over.recording)
    course = json.loads(recording.with_suffix(".online.json").read_text(encoding="utf-8"))
    (alarm,) = [alarm for alarm in course["alarms"] if alarm["settled"]]
    assert alarm["after"]["value"] == pytest.approx(0.8**0.5 * alarm["before"]["value"], rel=0.03)
    assert over.alarms == 1
    with RunStore(tmp_path) as store:
        (listed,) = store.find()
        run = store.get(listed.run_id)
    assert (run.run_id, listed.alarms, run.entry.outcome) == (over.run_id, 1, "inverter m2: no TPDO")
    attached = run.latest(ONLINE)
    assert attached is not None
    assert attached.as_json() == course


def test_what_is_kept_is_what_a_replay_gives(rows: list[Sample], drive: Drive, tmp_path: Path) -> None:
    over = drive(rows[:1500], tmp_path)
    assert over.recording is not None
    assert over.alarms == 0
    again = tmp_path / "again.json"
    record = read_record(Path(over.recording))
    play_record(record, tracking_settings(), Pace(), lambda course, time_s: None).write(again)
    assert again.read_bytes() == Path(over.recording).with_suffix(".online.json").read_bytes()
