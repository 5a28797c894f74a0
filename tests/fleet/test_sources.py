"""Recordings are found in folders, globs, datasets and behind URLs, and each belongs to a vehicle."""

import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from hil.errors import HilError, UsageError
from hil.fleet.run import Fleet
from hil.fleet.sources import FleetRecording, at_hand, find, pattern_of, seen, side_by_side

ROWS = "time_s,torque_m1_nm,torque_m2_nm,speed_rad_s\n0,1,1,1\n0.01,1,1,1\n"


def described(found: FleetRecording) -> FleetRecording:
    return found.seen_as(seen(found.url))


KEYS = {"AWS_ACCESS_KEY_ID": "none", "AWS_SECRET_ACCESS_KEY": "none", "AWS_DEFAULT_REGION": "us-east-1"}


@pytest.fixture
def drives(tmp_path: Path) -> Path:
    for name in ("bus_1/run_1.csv", "bus_2/run_1.csv", "vehicle=7/rig=a/run.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(ROWS)
    (tmp_path / "bus_1" / "notes.md").write_text("no recording")
    (tmp_path / "bus_1" / ".hidden.csv").write_text(ROWS)
    return tmp_path


def test_a_folder_a_glob_and_a_file_name_recordings_once(drives: Path) -> None:
    found, complaints = find([str(drives), f"{drives}/bus_*/*.csv", str(drives / "bus_1" / "run_1.csv")], None)
    assert [each.url for each in found] == [
        str(drives / name) for name in ("bus_1/run_1.csv", "bus_2/run_1.csv", "vehicle=7/rig=a/run.csv")
    ]
    assert complaints == []
    assert (found[2].vehicle, found[2].rig) == ("7", "a")


def test_results_among_the_recordings_are_none(drives: Path) -> None:
    for name in ("recordings/command=identify/part-1.parquet", "failures.parquet"):
        (drives / name).parent.mkdir(parents=True, exist_ok=True)
        (drives / name).write_text("a part")
    assert len(find([str(drives)], None)[0]) == 3


def test_an_empty_folder_and_one_that_is_not_there_are_named_and_the_rest_continues(drives: Path) -> None:
    (drives / "empty").mkdir()
    found, complaints = find([str(drives / "empty"), str(drives / "nowhere"), str(drives / "bus_1")], None)
    assert len(found) == 1
    assert "expected recordings, got none" in complaints[0]
    assert "no such file or folder" in complaints[1]


def test_a_pattern_takes_vehicle_rig_and_date_from_the_path(drives: Path) -> None:
    pattern = pattern_of(r"(?P<vehicle>bus_\d+)/(?P<rig>run)_(?P<started>\d+)")
    found, _ = find([str(drives / "bus_2")], pattern)
    assert (found[0].vehicle, found[0].rig, found[0].started) == ("bus_2", "run", "1")


@pytest.mark.parametrize("text", ["(", "bus_[0-9]+", "(?P<wheel>x)"])
def test_a_pattern_that_takes_nothing_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="--pattern: expected"):
        pattern_of(text)


def test_a_recording_says_whose_it_is_or_its_folder_does(drives: Path) -> None:
    path = drives / "bus_1" / "run_1.csv"
    assert described(FleetRecording(str(path))).vehicle == "bus_1"
    plain = described(FleetRecording(str(path))).sha256
    assert plain == hashlib.sha256(ROWS.encode()).hexdigest()
    said = {"schema": "hil.recording/1", "started_utc": "2026-01-02T03:04:05+00:00", "rig_file": 'name = "bench 2"'}
    path.with_name("run_1.csv.json").write_text(json.dumps(said))
    found = described(FleetRecording(str(path)))
    assert (found.vehicle, found.rig, found.started) == ("bench 2", "bench 2", "2026-01-02T03:04:05+00:00")
    assert found.sha256 != plain
    path.with_name("run_1.csv.json").write_text(json.dumps({**said, "vehicle": "bus 9"}))
    assert described(FleetRecording(str(path))).vehicle == "bus 9"
    with pytest.raises(HilError, match="expected a recording"):
        described(FleetRecording(str(drives / "bus_1" / "notes.md")))


def test_recordings_of_one_name_stand_side_by_side(drives: Path) -> None:
    both = [described(FleetRecording(str(drives / name / "run_1.csv"))) for name in ("bus_1", "bus_2")]
    (drives / "bus_2" / "run_1.csv").write_text(ROWS.replace("0.01", "0.02"))
    both[1] = described(FleetRecording(both[1].url))
    with side_by_side(both) as paths:
        assert len({path.stem for path in paths}) == 2
        assert [path.read_text() for path in paths] == [ROWS, ROWS.replace("0.01", "0.02")]


def test_vehicles_of_two_rigs_are_kept_apart_and_duplicates_named() -> None:
    fleet = Fleet(
        [FleetRecording("a", "bus_1", "x"), FleetRecording("b", "bus_1", "y"), FleetRecording("c", "bus_2", "x")]
    )
    fleet.duplicates.append((FleetRecording("d"), FleetRecording("a")))
    assert len(fleet.pieces(by_vehicle=True)) == 3
    assert len(fleet.pieces(by_vehicle=False)) == 3
    assert fleet.remarks() == [
        "d: the same content as a, counted once",
        "vehicle bus_1: recordings of 2 rigs (x, y), kept separate",
    ]


@pytest.fixture
def s3(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Serve S3 on loopback; the address of a folder in it."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    for key, value in {**KEYS, "AWS_ENDPOINT_URL": f"http://{host}:{port}"}.items():
        monkeypatch.setenv(key, value)
    yield "s3://drives/2026"
    server.stop()


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # inside botocore
def test_recordings_in_s3_are_found_and_fetched_with_what_they_say(s3: str) -> None:
    import fsspec

    fs = fsspec.filesystem("s3", skip_instance_cache=True)
    fs.mkdir("drives")
    fs.pipe("drives/2026/bus_1/run_1.csv", ROWS.encode())
    fs.pipe("drives/2026/bus_1/run_1.csv.json", json.dumps({"schema": "hil.recording/1", "vehicle": "9"}).encode())
    for source in (s3, f"{s3}/*/run_*.csv"):
        (found,), complaints = find([source], None)
        assert (found.url, complaints) == ("s3://drives/2026/bus_1/run_1.csv", [])
    assert described(found).vehicle == "9"
    with at_hand(found.url) as path:
        assert path.read_text() == ROWS
    assert not path.exists()
    with pytest.raises(HilError, match="got none of that name"), at_hand(f"{s3}/bus_1/run_2.csv"):
        pass
    _, complaints = find(["s3://somewhere-else/"], None)
    assert "s3://somewhere-else/: expected files that can be listed, got:" in complaints[0]


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_missing_credentials_are_named(s3: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import fsspec

    for key in KEYS:
        monkeypatch.delenv(key)
    monkeypatch.setenv("AWS_EC2_METADATA_DISABLED", "true")
    monkeypatch.setenv("HOME", str(tmp_path))
    fsspec.get_filesystem_class("s3").clear_instance_cache()
    assert "AWS_ACCESS_KEY_ID" not in os.environ
    _, complaints = find([s3], None)
    assert "credentials" in complaints[0].lower()
