"""``hil simulate``: the closed-form motion comes out, wrong input leaves nothing."""

import re
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run
from tests.cli import bench


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def arguments(tmp_path: Path) -> dict[str, Path]:
    bench.record(tmp_path / "run_1.csv", 1)
    return {
        "--model": bench.model(tmp_path / "drive.toml"),
        "--input": tmp_path / "run_1.csv",
        "--out": tmp_path / "simulated.csv",
    }


def call(arguments: dict[str, Path]) -> int:
    return run(["simulate", *(str(word) for pair in arguments.items() for word in pair)])


def test_the_simulation_is_the_motion_in_closed_form(
    arguments: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    truth = bench.record(arguments["--input"], 1, noise=0.05)
    assert call(arguments) == 0
    lines = arguments["--out"].read_text().splitlines()
    assert lines[0] == "time_s,speed_sim_rad_s"
    rows = np.loadtxt(lines[1:], delimiter=",")
    np.testing.assert_allclose(rows[:, 0], bench.DT * np.arange(truth.size), atol=1e-12)
    # Load and initial speed are estimated from 1500 samples of 0.05 rad/s noise: about 0.05/sqrt(1500) each.
    np.testing.assert_allclose(rows[:, 1], truth, atol=0.02)
    out = capsys.readouterr().out
    assert "run_1: 1500 samples, RMS error 0.0" in out
    load = re.search(r"constant load ([\d.]+) Nm", out)
    assert load is not None
    assert float(load[1]) == pytest.approx(bench.LOAD, abs=0.02)


def test_a_position_in_translation_is_named_and_scaled(arguments: dict[str, Path]) -> None:
    truth = bench.record(arguments["--input"], 1)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (truth[1:] + truth[:-1]) * bench.DT)])
    table = np.loadtxt(arguments["--input"], delimiter=",", skiprows=1)
    table = np.column_stack([table[:, :3], 1000 * angle])
    np.savetxt(
        arguments["--input"], table, delimiter=",", header="t,torque_m1_nm,torque_m2_nm,x_mm", comments="", fmt="%.12g"
    )
    signals = '[signals]\ntime = { column = "t" }\nposition = { column = "x_mm", scale = 0.001 }\n'
    arguments["--model"].write_text(bench.MODEL.replace("rotation", "translation") + signals)
    assert call(arguments) == 0
    assert arguments["--out"].read_text().startswith("time_s,position_sim_m\n")
    rows = np.loadtxt(arguments["--out"], delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 1], angle, atol=1e-3)


@pytest.mark.parametrize(
    ("option", "name", "said"),
    [
        ("--model", "nowhere.toml", "No such file"),
        ("--input", "nowhere.csv", "No such file"),
        ("--input", "drive.toml", "expected a recording"),
        ("--out", "simulated.parquet", "ends in .csv"),
        ("--out", "run_1.csv", "another file than the recording itself"),
        ("--out", "drive.toml/simulated.csv", "which is a file"),
    ],
)
def test_wrong_arguments_are_refused_and_nothing_written(
    arguments: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, name: str, said: str
) -> None:
    before = (tmp_path / "run_1.csv").read_text()
    assert call({**arguments, option: tmp_path / name}) == 2
    assert said in capsys.readouterr().err
    assert files(tmp_path) == ["drive.toml", "run_1.csv"]
    assert (tmp_path / "run_1.csv").read_text() == before
