"""A joint on a bench through the commands: a spring with a gap, worked out by hand."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from hil.cli.main import run

STIFFNESS, GAP, OFFSET, NOISE = 2000.0, 0.02, 4.0, 0.5

MODEL = """schema = "hil.model/1"
structure = "joint"

[parameters]
k = { value = 1800, tolerance = 0.5 }
c = { value = 1, tolerance = 0 }

[signals]
time     = { column = "t" }
position = { column = "phi" }
torque   = [ { column = "T" } ]
"""


def bench_recording(path: Path, amplitude: float, seed: int) -> np.ndarray:
    """Write a recording; return the torque without noise."""
    t = 0.005 * np.arange(2000)
    phi = amplitude * np.sin(2.0 * np.pi * 0.4 * t) * np.sin(2.0 * np.pi * 0.09 * t)
    rate = np.gradient(phi, t)
    beyond = np.sign(phi) * np.maximum(np.abs(phi) - 0.5 * GAP, 0.0)
    torque: np.ndarray = STIFFNESS * beyond + 1.0 * rate * (beyond != 0.0) - OFFSET
    read = torque + NOISE * np.random.default_rng(seed).standard_normal(t.size)
    np.savetxt(path, np.column_stack([t, phi, read]), delimiter=",", header="t,phi,T", comments="", fmt="%.12g")
    return torque


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path, Path]:
    model, small, large = tmp_path / "joint.toml", tmp_path / "small.csv", tmp_path / "large.csv"
    model.write_text(MODEL)
    bench_recording(small, 0.03, 1)
    bench_recording(large, 0.06, 2)
    return model, small, large


def test_the_gap_of_a_joint_is_named_and_simulates_again(files: tuple[Path, Path, Path], tmp_path: Path) -> None:
    model, small, large = files
    assert run(["diagnose", str(small), str(large), "--model", str(model), "--out", str(tmp_path / "out")]) == 0
    verdict = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert verdict["verdict"] == "explained"
    assert [effect["name"] for effect in verdict["effects"]] == ["backlash"]
    gap = verdict["effects"][0]["parameters"]["gap_rad"]
    assert gap["value"] == pytest.approx(GAP, rel=0.05)
    assert verdict["fit"]["unit"] == "Nm"
    assert verdict["fit"]["augmented"] < 1.1 * NOISE
    assert verdict["mismatch"]["element"] == "shaft"

    fresh = tmp_path / "fresh.csv"
    true = bench_recording(fresh, 0.045, 3)
    simulated = tmp_path / "simulated.csv"
    augmented = str(tmp_path / "out" / "augmented.toml")
    assert run(["simulate", "--model", augmented, "--input", str(fresh), "--out", str(simulated)]) == 0
    with simulated.open() as file:
        torque = np.array([float(row["force_sim_nm"]) for row in csv.DictReader(file)])
    assert float(np.sqrt(np.mean((torque - true) ** 2))) < 0.5 * NOISE
