"""The error that a diagnosis gives is found again with the model it wrote, and every result says what made it."""

import hashlib
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run
from hil.recording import Table, csv_format, read_table
from tests.cli import bench

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
