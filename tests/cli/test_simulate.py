"""``hil simulate``: the closed-form motion comes out, wrong input leaves nothing."""

import hashlib
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run
from hil.recording import Table, csv_format, read_table
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


def test_a_simulation_that_runs_away_is_reported_by_both_commands(
    arguments: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    with arguments["--model"].open("a") as file:
        file.write("\n[effects.warming_friction]\ncold_nm_s = { value = 1e8 }\ntime_constant_s = { value = 3.0 }\n")
    assert call(arguments) == 0
    message = capsys.readouterr().err
    assert "run_1: the simulation runs away" in message
    assert "Check the model's values (parameters, warming_friction)" in message
    assert run(["compare", str(arguments["--model"]), str(arguments["--input"])]) == 0
    assert "drive.toml: run_1: the simulation runs away" in capsys.readouterr().err


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


FLAGGED, HELD = (300, 312), (700, 760)


def flagged(path: Path) -> None:
    """Record with twelve flagged rows that hold nonsense, and a speed reading that stands still for a while."""
    bench.record(path, 1, noise=0.05)
    numbers = read_table(path).numeric(["time_s", "torque_m1_nm", "torque_m2_nm", "speed_rad_s"])
    flags = np.zeros(numbers["time_s"].size, dtype=np.int64)
    flags[slice(*FLAGGED)] = 1
    for name in ("torque_m1_nm", "torque_m2_nm", "speed_rad_s"):
        numbers[name][slice(*FLAGGED)] = 0.0
    numbers["speed_rad_s"][slice(*HELD)] = numbers["speed_rad_s"][HELD[0]]
    csv_format.write(Table(path, {**numbers, "flags": flags}), path)


def test_compare_and_simulate_give_the_error_of_the_diagnosis(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, model, out = tmp_path / "run_1.csv", bench.model(tmp_path / "drive.toml"), tmp_path / "out"
    flagged(recording)
    command = ["diagnose", str(recording), "--model", str(model), "--out", str(out), "--budget-s", "300"]
    assert run(command) == 0
    reported = json.loads((out / "diagnosis.json").read_text())["fit"]["augmented"]
    augmented = str(out / "augmented.toml")
    used = tomllib.loads(Path(augmented).read_text())["prepared"]["recordings"][0]
    capsys.readouterr()
    assert run(["compare", augmented, str(recording), "--json"]) == 0
    compared = json.loads(capsys.readouterr().out)["recordings"]["run_1"]
    assert compared["rms"] == pytest.approx(reported, rel=0.005)
    assert compared["samples_used"] == used["samples_used"] == 1500 - 12 - 60
    assert (
        run(["simulate", "--model", augmented, "--input", str(recording), "--out", str(out / "s.csv"), "--json"]) == 0
    )
    assert json.loads(capsys.readouterr().out)["rms"]["value"] == pytest.approx(reported, rel=0.005)


def test_every_result_says_what_made_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording, model = tmp_path / "run_1.csv", bench.model(tmp_path / "drive.toml")
    bench.record(recording, 1, noise=0.05)
    lines = {
        "diagnosis.json": ["diagnose", str(recording), "--model", str(model)],
        "compare.json": ["compare", str(model), str(recording)],
        "identification.json": ["identify", str(recording), "--model", str(model)],
    }
    for name, line in lines.items():
        out = tmp_path / name.partition(".")[0]
        assert run([*line, "--out", str(out)]) == 0
        made = json.loads((out / name).read_text())["made"]
        assert made["command"].startswith(f"hil {line[0]} ")
        assert made["program"].startswith("hil ")
        for key, path in (("models", model), ("recordings", recording)):
            assert made[key] == [{"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}]
        page = next(out.glob("*.html")).read_text()
        assert "How this was made" in page
        assert made["recordings"][0]["sha256"] in page
