"""What a run estimates while it drives is what its recording says afterwards; and it stays out of the cycle's way."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from estimator.signals.record import Record
from hil.recording import RecordingWriter, read_record
from hil.rig import live_course
from hil.rig.build import open_devices
from hil.rig.experiments.base import Phase
from hil.rig.live import LiveEstimate, Pace, play_record, tracking_chain, tracking_settings
from hil.rig.plan import plan_run
from hil.rig.session import run_plan
from hil.rig.stop import StopRequest
from hil.sample import Sample, SampleFlag
from tests.estimator.identification.tracking.drives import drives
from tests.rig.observer import assert_disarmed
from tests.rig.serving import Samples, fast, served


def driven(flagged: tuple[int, ...] = (), record: Record | None = None) -> list[Sample]:
    """A drive as samples of a run; some flagged, their values next to the truth, as stand-ins have them."""
    record = record or drives(21, 1, 16.0)[0]
    samples = []
    for k, (t, (m1, m2), speed) in enumerate(
        zip(record.time_s.tolist(), record.torque_nm.tolist(), record.output.tolist(), strict=True)
    ):
        flags = SampleFlag.M1_STALE if k in flagged else SampleFlag.GOOD
        torque_nm = math.nan if k in flagged and k < 3 else m1 + (99.0 if k in flagged else 0.0)
        samples.append(Sample(k, k, t, 0.0, 0.0, 0.0, torque_nm, m2, speed, 0, flags))
    return samples


def run_observed(rig: object, observers: tuple[object, ...], samples: Samples) -> None:
    with open_devices(rig) as devices:  # type: ignore[arg-type]
        plan = plan_run(rig, "cruise")  # type: ignore[arg-type]
        run_plan(
            devices,
            plan,
            fast(rig),  # type: ignore[arg-type]
            samples,
            StopRequest(),
            lambda phase, time_s: None,
            observers=observers,  # type: ignore[arg-type]
        )


def test_observers_see_every_phase_and_what_is_recorded() -> None:
    seen: list[tuple[Sample, Phase]] = []
    samples = Samples()
    with served() as (_, rig):
        run_observed(rig, (lambda sample, phase: seen.append((sample, phase)),), samples)
    assert [sample for sample, phase in seen if phase is Phase.MEASURE] == samples.rows
    assert {phase for _, phase in seen} > {Phase.MEASURE}


def test_an_observer_that_fails_ends_the_run_disarmed() -> None:
    def fail(sample: Sample, phase: Phase) -> None:
        if phase is Phase.MEASURE:
            raise RuntimeError("observer at fault")

    with served() as (server, rig):
        with pytest.raises(RuntimeError, match="observer at fault"):
            run_observed(rig, (fail,), Samples())
        assert_disarmed(server.bus_url, 1, 2)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_live_is_replay_to_the_bit(tmp_path: Path, suffix: str) -> None:
    samples = driven(flagged=(0, 1, 2, 500, 501, 900))
    live = LiveEstimate(tracking_chain(0.01))
    with RecordingWriter(tmp_path / f"run{suffix}") as recorder:
        for sample in samples:
            recorder.append(sample)
            live(sample, Phase.MEASURE)
    course = play_record(
        read_record(tmp_path / f"run{suffix}"), tracking_settings(), Pace(), lambda course, time_s: None
    )
    live.course.write(tmp_path / "live.json")
    course.write(tmp_path / "replay.json")
    assert live.latest is not None
    assert live.latest.resonance is not None
    assert (tmp_path / "live.json").read_bytes() == (tmp_path / "replay.json").read_bytes()


def test_what_a_run_says_of_its_excitation_its_replay_says_too(tmp_path: Path) -> None:
    drive = drives(23, 1, 75.0, prbs_nm=lambda time_s: 0.0 if 40.0 <= time_s < 60.0 else 120.0)[0]
    live = LiveEstimate(tracking_chain(0.01))
    for sample in driven(record=drive):
        live(sample)
    live.course.write(tmp_path / "live.json")
    play_record(drive, tracking_settings(), Pace(), lambda course, time_s: None).write(tmp_path / "replay.json")
    assert (tmp_path / "live.json").read_bytes() == (tmp_path / "replay.json").read_bytes()
    document = json.loads((tmp_path / "live.json").read_text())
    states = [entry["state"] for entry in document["states"]]
    assert states == ["starting", "learning", "watching", "not_excited", "watching"]
    off_s, on_s = (entry["from_s"] for entry in document["states"][3:])
    assert 40.0 < off_s < 43.0
    assert 59.0 < on_s < 62.0
    assert document["alarms"] == []
    assert (document["final"]["status"], document["final"]["state"]) == ("estimated", "watching")
    assert live.course.excitation == f"not excited for {on_s - off_s:.1f} of 75.0 s: no alarm then"


@pytest.mark.parametrize(("most", "every"), [(401, 1), (400, 2), (256, 2), (64, 8)])
def test_a_long_course_is_thinned_the_same_by_run_and_replay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: int, every: int
) -> None:
    drive, whole = drives(22, 1, 8.0)[0], tmp_path / "whole.json"
    play_record(drive, tracking_settings(), Pace(), lambda course, time_s: None).write(whole)
    monkeypatch.setattr(live_course, "MOST_ESTIMATES", most)
    live = LiveEstimate(tracking_chain(0.01))
    for sample in driven(record=drive):
        live(sample)
    live.course.write(tmp_path / "live.json")
    play_record(drive, tracking_settings(), Pace(4.0, sleep=lambda s: None), lambda course, time_s: None).write(
        tmp_path / "replay.json"
    )
    assert (tmp_path / "live.json").read_bytes() == (tmp_path / "replay.json").read_bytes()
    thinned, document = (json.loads((tmp_path / name).read_text()) for name in ("live.json", "whole.json"))
    assert (thinned["every"], thinned["estimates"], document["every"]) == (every, 400, 1)
    for name, column in thinned["course"].items():
        assert column == document["course"][name][::every], name
        assert len(column) < most


@pytest.mark.parametrize("speed", [2.0, 50.0])
def test_speed_is_that_of_the_clock(speed: float) -> None:
    now = [0.0]

    def sleep(seconds: float) -> None:
        now[0] += seconds

    reported: list[tuple[float, float]] = []
    pace = Pace(speed, clock=lambda: now[0], sleep=sleep)
    play_record(
        drives(22, 1, 8.0)[0], tracking_settings(), pace, lambda course, time_s: reported.append((time_s, now[0]))
    )
    times = np.array(reported)
    assert times[:, 1] == pytest.approx(times[:, 0] / speed)
    assert len(reported) > 8.0 / speed * 9
