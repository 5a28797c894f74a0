"""Recordings as they are made: whole, interrupted, killed."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hil.errors import RecordingError
from hil.recording import RecordingWriter, columns, read_record, read_table
from hil.recording.checksum import CHECKSUM, SAID, data_sha256, said_sha256
from hil.recording.formats import FORMATS
from hil.recording.own_csv import HEADER
from hil.recording.writer import NOT_ENDED
from hil.sample import Sample, SampleFlag
from hil.store import RunStore
from hil.store.rebuild import rebuild

WRITABLE = [suffix for suffix, form in FORMATS.items() if form.write]


def sample(k: int) -> Sample:
    return Sample(
        cycle=k,
        t_ns=10_000_000 * k,
        time_s=0.01 * k,
        torque_ref_m1_nm=1.1 * k,
        torque_ref_m2_nm=2.2 * k,
        prbs_nm=(-1.0) ** k,
        torque_m1_nm=math.nan if k == 0 else k / 3,
        torque_m2_nm=k / 7,
        speed_rad_s=k * math.pi,
        age_ns=1_234_567 + k,
        flags=SampleFlag.M2_STALE | SampleFlag.LATE if k == 3 else SampleFlag.GOOD,
    )


def check(path: Path, n: int) -> None:
    table = read_table(path)
    assert list(table.columns) == list(columns.UNITS)
    for k in range(n):
        s = sample(k)
        expected = (s.time_s, s.torque_ref_nm, s.torque_m1_nm, s.torque_m2_nm, s.speed_rad_s, s.prbs_nm)
        expected += (int(s.flags), s.torque_ref_m1_nm, s.torque_ref_m2_nm, s.age_ns / 1e9)
        row = [table.columns[name][k] for name in columns.UNITS]
        assert [repr(float(a)) for a in row] == [repr(float(b)) for b in expected]
    assert table.n_rows == n


@pytest.mark.parametrize("suffix", WRITABLE)
def test_a_run_is_recorded_to_the_bit(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"run{suffix}"
    with RecordingWriter(path, {"rig": "bench"}) as writer:
        for k in range(30):
            writer.append(sample(k))
    check(path, 30)
    companion = {f"{path.name}.json"} if suffix == ".csv" else set()
    assert {file.name for file in tmp_path.iterdir()} == {path.name} | companion
    record = read_record(path)
    assert record.okay.tolist() == [k not in (0, 3) for k in range(30)]


@pytest.mark.parametrize("suffix", WRITABLE)
def test_a_recording_carries_units_metadata_and_checksum(tmp_path: Path, suffix: str) -> None:
    with RecordingWriter(tmp_path / f"run{suffix}", {"schema": "hil.recording/1", "rig": "bench"}) as writer:
        writer.append(sample(1))
    table = read_table(tmp_path / f"run{suffix}")
    said = {"schema": "hil.recording/1", "rig": "bench", SAID: said_sha256(table.units, table.metadata)}
    assert dict(table.metadata) == {**said, CHECKSUM: data_sha256(table.columns)}
    assert dict(table.units) == dict(columns.UNITS)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_an_interrupted_run_leaves_what_it_had(tmp_path: Path, suffix: str, error: type[BaseException]) -> None:
    path = tmp_path / f"run{suffix}"

    def run() -> None:
        with RecordingWriter(path) as writer:
            for k in range(12):
                writer.append(sample(k))
            raise error

    with pytest.raises(error):
        run()
    check(path, 12)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_killed_run_leaves_every_appended_row_readable(tmp_path: Path, suffix: str) -> None:
    writer = RecordingWriter(tmp_path / f"run{suffix}")
    with writer:
        for k in range(12):
            writer.append(sample(k))
        while writer.n_samples < 12:  # the disk takes them in a thread of its own
            time.sleep(0.001)
        # Seen from outside at this moment, as after a kill: no flush, no close.
        check(tmp_path / "run.part.csv", 12)
        assert not writer.path.exists()


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("mine")
    with (
        pytest.raises(RecordingError, match="a recording is never overwritten"),
        RecordingWriter(tmp_path / "run.csv"),
    ):
        pass
    assert (tmp_path / "run.csv").read_text() == "mine"


@pytest.mark.parametrize("suffix", WRITABLE)
def test_a_name_taken_during_the_run_costs_no_sample(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"run{suffix}"

    def run() -> None:
        with RecordingWriter(path) as writer:
            for k in range(12):
                writer.append(sample(k))
            path.write_text("mine")

    with pytest.raises(RecordingError, match="never overwritten"):
        run()
    assert path.read_text() == "mine"
    check(tmp_path / "run.part.csv", 12)


@pytest.mark.parametrize("name", ["run.mdf", "run.xyz", "nowhere/run.csv"])
def test_a_recording_that_cannot_be_made_is_refused_before_the_run(tmp_path: Path, name: str) -> None:
    with pytest.raises(RecordingError, match="expected"), RecordingWriter(tmp_path / name):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("left", [HEADER + "\n", HEADER, HEADER[:7], ""])
def test_a_part_file_without_a_sample_blocks_no_name(tmp_path: Path, left: str) -> None:
    (tmp_path / "run.part.csv").write_text(left)
    with RecordingWriter(tmp_path / "run.csv") as writer:
        for k in range(12):
            writer.append(sample(k))
    check(tmp_path / "run.csv", 12)


@pytest.mark.parametrize("left", [f"{HEADER}0.0", "time_s\n", f" {HEADER}"])
def test_one_with_anything_else_in_it_does(tmp_path: Path, left: str) -> None:
    (tmp_path / "run.part.csv").write_text(left)
    with (
        pytest.raises(RecordingError, match=r"run\.part\.csv: expected no such file"),
        RecordingWriter(tmp_path / "run.csv"),
    ):
        pass
    assert (tmp_path / "run.part.csv").read_text() == left


SAYS = {"schema": "hil.recording/1", "experiment": "cruise", "rig_file": 'name = "bench"\n'}


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_killed_run_describes_itself_and_is_listed_as_what_it_is(tmp_path: Path, suffix: str) -> None:
    program = (
        "import os, sys, time; from hil.recording import RecordingWriter; from tests.recording.test_writer import *\n"
        "with RecordingWriter(sys.argv[1], SAYS) as writer:\n"
        "    for k in range(12): writer.append(sample(k))\n"
        "    while writer.n_samples < 12: time.sleep(0.001)\n"
        "    os.kill(os.getpid(), 9)\n"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path / f"run{suffix}")], check=False, timeout=120)
    table = read_table(tmp_path / "run.part.csv")
    assert dict(table.metadata) == {**SAYS, "outcome": NOT_ENDED}
    assert dict(table.units) == dict(columns.UNITS)
    assert rebuild(tmp_path).found == 1
    with RunStore(tmp_path) as store:
        (run,) = store.find()
    assert (run.entry.rig_name, run.entry.samples, run.entry.outcome) == ("bench", 12, NOT_ENDED)
