"""``hil convert`` as a user has it."""

from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest

from hil.cli.main import run as hil
from hil.config.rig_file import read_rig
from hil.recording import Table, read_table, write_table
from hil.recording.publish import losses
from hil.recording.table import as_text
from hil.rig.replay import replay
from tests.cli.conftest import Simulation

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "run.csv"
    columns = {"time_s": 0.01 * np.arange(20), "speed_rad_s": np.arange(20.0), "gear": as_text(["1"] * 20)}
    write_table(Table(path, columns, {"time_s": "s"}, {"experiment": "cruise", "rig_file": "a = 1\n"}), path)
    return path


@pytest.mark.parametrize("suffix", [".parquet", ".mf4", ".h5", ".mat", ".csv"])
def test_there_and_back_is_the_same_file(source: Path, tmp_path: Path, suffix: str, capsys: Capture) -> None:
    there, back = tmp_path / f"there{suffix}", tmp_path / "back.csv"
    assert hil(["convert", str(source), str(there)]) == 0
    said = capsys.readouterr()
    assert f"{there}: 20 rows, 3 columns\n  experiment: cruise\n  rig_file: 1 lines\n" in said.out
    assert "(verified)" in said.out
    assert said.err == ""
    assert hil(["convert", str(there), str(back)]) == 0
    assert back.read_bytes() == source.read_bytes()
    assert losses(read_table(source), read_table(back)) == []


def test_what_is_lost_or_left_out_is_said_on_standard_error(tmp_path: Path, capsys: Capture) -> None:
    parquet, mdf = tmp_path / "a.parquet", tmp_path / "a.mf4"
    write_table(Table(parquet, {"x": np.arange(2.0), "word": as_text(["a\0b", "c"])}), parquet)
    assert hil(["convert", str(parquet), str(mdf)]) == 0
    said = capsys.readouterr()
    assert said.err == f"{mdf}: lost: column word: 1 of 2 cells change, the first in row 1: 'a\\x00b' becomes 'a'\n"
    assert "2 rows, 2 columns, not all of it" in said.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["gone.csv", "out.h5"], "gone.csv: expected a readable file"),
        (["run.csv", "out.xlsx"], "expected a name that ends in one of .csv, .parquet"),
        (["run.csv", "nowhere/out.h5"], "expected an existing folder"),
        (["run.csv", "out.h5", "--encoding", "klingon"], "--encoding: expected a text encoding such as"),
        (["run.csv", "out.h5", "--delimiter", "1"], "--delimiter: expected a character that can't be part"),
        (["run.csv", "out.h5", "--all"], "expected a bus trace with --rig, --all or --channel, got a recording"),
        (["run.blf", "out.h5"], "expected --rig RIG besides a bus trace"),
    ],
)
def test_wrong_use_leaves_nothing(
    source: Path, tmp_path: Path, arguments: list[str], said: str, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    assert hil(["convert", *arguments]) == 2
    assert said in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == before


def test_a_bus_trace_becomes_signals_by_the_eds_files(
    simulate: Callable[..., Simulation], short_rig: Path, tmp_path: Path
) -> None:
    """The trace is that of a run, so the torques and speeds are those of its recording, to the bit.

    That all three trace formats carry the same frames is tested where they are read (tests/rig).
    """
    trace = "run.blf"
    simulation = simulate(short_rig)
    addresses = simulation.addresses
    recorded, out = tmp_path / "run.parquet", tmp_path / "out.mf4"
    run = ["run", str(short_rig), "reversal", "--out", str(recorded), "--trace", str(tmp_path / trace), *addresses]
    assert hil([*run, "--pace", "fast", "--no-estimate"]) == 0
    assert hil(["convert", str(tmp_path / trace), str(out), "--rig", str(short_rig)]) == 0
    table, expected = read_table(out), read_table(recorded)
    for name in ("time_s", "torque_m1_nm", "torque_m2_nm", "speed_rad_s", "prbs_nm"):
        np.testing.assert_array_equal(table.columns[name], expected.columns[name])
    assert table.metadata["rig_file"] == short_rig.read_text(encoding="utf-8")
    assert table.metadata["replayed_from"] == trace
    assert table.units["torque_m1_nm"] == "Nm"
    both = tmp_path / "both.log"
    with can.LogReader(tmp_path / trace) as frames, can.Logger(both) as logger:
        for frame in frames:
            for channel in ("can0", "can1"):
                frame.channel = channel
                logger(frame)
    of_one = tmp_path / "of_one.parquet"
    assert hil(["convert", str(both), str(of_one), "--rig", str(short_rig), "--channel", "can1"]) == 0
    np.testing.assert_array_equal(read_table(of_one).columns["torque_m1_nm"], expected.columns["torque_m1_nm"])
    whole = list(replay(tmp_path / trace, read_rig(short_rig), whole=True))
    assert hil(["convert", str(tmp_path / trace), str(out), "--rig", str(short_rig), "--all", "--force"]) == 0
    assert read_table(out).n_rows == len(whole) > table.n_rows
